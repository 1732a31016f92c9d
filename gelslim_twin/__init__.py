"""The digital twin: simulated contacts of a sensor, with known forces and rendered frames.

A scene says what touches the sensor, how it moves and what is to be known. `plan_scene` chooses
the physical effects that matter for it, `simulate` solves the contact and renders the frames, and
`validate` measures the force pipeline on such frames. The names load when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gelslim_core.lazy import lazy_exports

if TYPE_CHECKING:
    from gelslim_twin.contact.gel_state import ContactError, GelState
    from gelslim_twin.effects.circumstances import SensorFigures
    from gelslim_twin.effects.effect import Effect
    from gelslim_twin.effects.registry import EFFECTS
    from gelslim_twin.planning.plan import Plan
    from gelslim_twin.planning.planner import PlanError
    from gelslim_twin.planning.question import plan_scene
    from gelslim_twin.planning.sensor_figures import bundle_figures
    from gelslim_twin.render.frame_renderer import FrameRenderer, RenderedFrame
    from gelslim_twin.scene.reader import LoadedScene, read_scene
    from gelslim_twin.simulation.run_folder import SimulationError
    from gelslim_twin.simulation.scene_task import job_of
    from gelslim_twin.simulation.sensor import TwinSensor, store_sensor, stored_sensor
    from gelslim_twin.simulation.simulate import SimulationJob, simulate
    from gelslim_twin.stepping.body import Body
    from gelslim_twin.stepping.state import TwinState
    from gelslim_twin.stepping.step import Step
    from gelslim_twin.stepping.step_batch import StepBatch
    from gelslim_twin.stepping.step_error import StepError
    from gelslim_twin.stepping.twin import Twin
    from gelslim_twin.validation.score import Validation
    from gelslim_twin.validation.validate import validate

__all__ = [
    "EFFECTS",
    "Body",
    "ContactError",
    "Effect",
    "FrameRenderer",
    "GelState",
    "LoadedScene",
    "Plan",
    "PlanError",
    "RenderedFrame",
    "SensorFigures",
    "SimulationError",
    "SimulationJob",
    "Step",
    "StepBatch",
    "StepError",
    "Twin",
    "TwinSensor",
    "TwinState",
    "Validation",
    "bundle_figures",
    "job_of",
    "plan_scene",
    "read_scene",
    "simulate",
    "store_sensor",
    "stored_sensor",
    "validate",
]

__getattr__, __dir__ = lazy_exports(__name__)
