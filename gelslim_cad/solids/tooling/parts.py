"""All tooling of a finger."""

from __future__ import annotations

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.part import Part
from gelslim_cad.markers.stencil import lay_out_stencil
from gelslim_cad.solids.tooling.calibration_target import calibration_target
from gelslim_cad.solids.tooling.cutting_template import cutting_template
from gelslim_cad.solids.tooling.fabric_skin import fabric_skin
from gelslim_cad.solids.tooling.fit_coupon import fit_coupon
from gelslim_cad.solids.tooling.focus_jig import focus_jig
from gelslim_cad.solids.tooling.mould import mould_parts
from gelslim_cad.solids.tooling.sphere_indenter import sphere_indenter
from gelslim_cad.solids.tooling.stencil import stencil, stencil_problem
from ifem_export.markers.grid import MarkerGrid


def tooling_parts(d: Dimensions, grid: MarkerGrid) -> tuple[Part, ...]:
    """Mould, templates, jigs and gauges, each in its own frame.

    `grid` is clipped to the gel's outline. Left out: the stencil where `stencil_problem` names
    a reason, the skin where the spec wants none. Raises SolidError naming a part that the kernel
    cannot make, ValueError when a dot crosses the gel's outline.
    """
    sheet = lay_out_stencil(grid, GelShape.of(d).outline)
    parts = [*mould_parts(d), cutting_template(d, sheet)]
    if not stencil_problem(grid):
        parts.append(stencil(sheet, grid))
    parts += [calibration_target(d), sphere_indenter(d), focus_jig(d), *fit_coupon(d)]
    if d["manufacturing.fabric_skin"]:
        parts.append(fabric_skin(d))
    return tuple(parts)
