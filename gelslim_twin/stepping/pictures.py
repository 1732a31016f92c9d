"""Markers and pictures of a stepped twin: its effects are planned once, for a usual contact.

The planner of scenes chooses the effects from what a scene observes, its motion and its tool. A
stepped twin does not know its motion in advance. In its place stands a ball of a quarter of the
pad's width, pressed a quarter of the gel's thickness deep and sheared as far, each in 0.1 s.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from gelslim_core.yaml.suggest import closest
from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning.planner import PlanError, Question, make_plan
from gelslim_twin.planning.question import motion_figures
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.footprint import tool_footprint
from gelslim_twin.scene.pose import poses
from gelslim_twin.scene.scene import FORMAT, Scene
from gelslim_twin.simulation.picture import Viewer
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.stepping.request import Request
from gelslim_twin.stepping.step_error import StepError

BALL_SHARE, DEPTH_SHARE, MOVE_S = 0.25, 0.25, 0.1
"""Radius of the ball over the pad's width, its depth over the gel's thickness, and time of a move.
"""


SCENES_ONLY = ("viscoelasticity", "sliding_friction", "adhesion")
"""Effects that single steps do not have."""


def stepped_scene(
    request: Request,
    friction: float,
    effects: Mapping[str, Any] | None,
    seed: int,
    size_mm: tuple[float, float, float],
) -> Scene:
    """The scene that stands for the steps.

    Args:
        request: What is observed.
        friction: Coefficient of friction.
        effects: Block `effects` of a scene file.
        seed: Seed of noise, dirt and print faults.
        size_mm: Length, width and thickness of the pad.

    Raises:
        StepError: Friction, seed or an effect cannot be used.
    """
    names = [effect.name for effect in EFFECTS]
    for name in effects or {}:
        if name not in names:
            near = closest(str(name), names)
            hint = f"did you mean {near}?" if near else f"the effects are {', '.join(names)}"
            raise StepError(f"effects: {name!r} is unknown; {hint}")
    depth = DEPTH_SHARE * size_mm[2]
    try:
        scene = Scene.model_validate_json(
            json.dumps(
                {
                    "format": FORMAT,
                    "name": "steps",
                    "sensor": {"bundle": "bundle"},
                    "indenters": [{"shape": "sphere", "radius_mm": BALL_SHARE * min(size_mm[:2])}],
                    "motion": {
                        "waypoints": [
                            {"move": "press", "depth_mm": depth, "duration_s": MOVE_S},
                            {"move": "shear", "x_mm": depth, "duration_s": MOVE_S},
                        ]
                    },
                    "contact": {"friction": friction},
                    "observe": list(request.observe),
                    "tolerance": {"image_px": request.image_px},
                    "effects": dict(effects or {}),
                    "seed": seed,
                }
            )
        )
    except TypeError as error:
        raise StepError(f"effects: {str(error).lower()}; give numbers, words and lists") from None
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise StepError(f"{where} = {first['input']!r}: {first['msg'].lower()}") from None
    _require_stepped(scene)
    return scene


def _require_stepped(scene: Scene) -> None:
    given = scene.effects.parameters()
    for name in SCENES_ONLY:
        asked = given[name]
        if asked.use != "off" and asked.model_copy(update={"use": "auto"}) != type(asked)():
            raise StepError(
                f"effects: {name} is simulated in scenes only; leave it out, or switch it off"
            )


def stepped_viewer(sensor: TwinSensor, folder: Path, scene: Scene, request: Request) -> Viewer:
    """Camera and renderer with the effects that the request needs.

    Args:
        sensor: The sensor.
        folder: Folder of its bundle.
        scene: Result of `stepped_scene`.
        request: What is observed.

    Raises:
        StepError: An effect is switched off without which there is no picture.
        IfemError: The bundle has no markers or no camera.
    """
    figures = bundle_figures(folder)
    footprint = tool_footprint(
        scene.indenters, Path(), figures.length_mm * figures.width_mm, figures.node_pitch_mm
    )
    asked = Question(
        scene.name,
        request.seen,
        scene.tolerance.force_n,
        request.image_px,
        Circumstances(
            figures,
            motion_figures(poses(scene.motion), footprint),
            footprint,
            scene.contact.friction,
            scene.effects.parameters(),
        ),
    )
    try:
        return Viewer(sensor, make_plan(asked), scene)
    except PlanError as error:
        raise StepError(f"effects: {error}") from None


def pad_size_mm(sensor: TwinSensor) -> tuple[float, float, float]:
    """Length, width and thickness of the pad."""
    mesh = sensor.bundle.mesh
    return (*sensor.size_mm, mesh.layers * mesh.cell_size_mm[2])
