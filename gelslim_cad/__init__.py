"""From a YAML spec to a tactile finger: dimensions, design rules, parts, files and report.

`read_spec` reads a spec, `derive` computes its dimensions, `check` applies the design rules, and
`build_variant` writes every file. The names below are the public face of this package; each loads
when it is first used, so that CAD libraries are needed only for parts and builds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gelslim_core.lazy import lazy_exports

if TYPE_CHECKING:
    from gelslim_cad.build.variant import BuildRefusedError, BuildResult, build_variant
    from gelslim_cad.checks.apply import check
    from gelslim_cad.checks.rule import Check
    from gelslim_cad.dimensions.dimensions import Dimensions, derive
    from gelslim_cad.export.glb import glb_bytes
    from gelslim_cad.export.step import step_bytes
    from gelslim_cad.geometry.optics import guide_profile, virtual_camera
    from gelslim_cad.geometry.part import Part
    from gelslim_cad.sensor import make_bundle, marker_grid, pad_mesh
    from gelslim_cad.solids.finger import finger_parts, tooling_parts
    from gelslim_cad.solids.shapes import SolidError
    from gelslim_cad.spec.reader import LoadedSpec, read_spec
    from gelslim_cad.spec.spec import Spec

__all__ = [
    "BuildRefusedError",
    "BuildResult",
    "Check",
    "Dimensions",
    "LoadedSpec",
    "Part",
    "SolidError",
    "Spec",
    "build_variant",
    "check",
    "derive",
    "finger_parts",
    "glb_bytes",
    "guide_profile",
    "make_bundle",
    "marker_grid",
    "pad_mesh",
    "read_spec",
    "step_bytes",
    "tooling_parts",
    "virtual_camera",
]

__getattr__, __dir__ = lazy_exports(__name__)
