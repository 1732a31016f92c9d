"""Tactile fingers of the GelSlim type: from a spec to parts, forces and simulated contacts.

Each name is loaded when it is first used, so that `import gelslim` is fast and needs neither CAD
nor rendering libraries.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gelslim_core import __version__
from gelslim_core.lazy import lazy_exports

if TYPE_CHECKING:
    from gelslim.contacts import data_set, plan, simulate, validate
    from gelslim.data_sets import merge_data_sets, verify_data_set
    from gelslim.design import build, check, derive, make_bundle
    from gelslim.examples import examples
    from gelslim_cad.tolerance.asked import read_spec
    from gelslim_core.budget.budget import Budget
    from gelslim_core.errors import GelslimError
    from gelslim_force.calibration.calibration import calibrate
    from gelslim_force.frames.source import open_frames
    from gelslim_force.pipeline import ForcePipeline
    from gelslim_force.sensor import open_sensor
    from gelslim_twin.scene.reader import read_scene
    from gelslim_twin.stepping.body import Body
    from gelslim_twin.stepping.state import TwinState
    from gelslim_twin.stepping.twin import Twin
    from ifem_export.bundle.files import load_bundle, write_bundle

__all__ = [
    "Body",
    "Budget",
    "ForcePipeline",
    "GelslimError",
    "Twin",
    "TwinState",
    "__version__",
    "build",
    "calibrate",
    "check",
    "data_set",
    "derive",
    "examples",
    "load_bundle",
    "make_bundle",
    "merge_data_sets",
    "open_frames",
    "open_sensor",
    "plan",
    "read_scene",
    "read_spec",
    "simulate",
    "validate",
    "verify_data_set",
    "write_bundle",
]

__getattr__, __dir__ = lazy_exports(__name__)
