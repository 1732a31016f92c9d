"""All parts of the finger, and all tooling that it is made with."""

from __future__ import annotations

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.part import Part
from gelslim_cad.markers.stencil import lay_out_stencil
from gelslim_cad.solids.adapter import adapter
from gelslim_cad.solids.bezel import bezel, shims
from gelslim_cad.solids.body import body
from gelslim_cad.solids.camera import camera, camera_clamp
from gelslim_cad.solids.cover import cover
from gelslim_cad.solids.gel import gel_pad
from gelslim_cad.solids.guide import guide_blank, led_boards, light_guide
from gelslim_cad.solids.mirror import mirror, mirror_seat
from gelslim_cad.solids.screws import screws
from gelslim_cad.solids.tooling.calibration import calibration_target, sphere_indenter
from gelslim_cad.solids.tooling.fit_coupon import fit_coupon
from gelslim_cad.solids.tooling.focus_jig import focus_jig
from gelslim_cad.solids.tooling.mould import mould_parts
from gelslim_cad.solids.tooling.sheets import (
    cutting_template,
    fabric_skin,
    stencil,
    stencil_problem,
)
from ifem_export.markers.grid import MarkerGrid


def finger_parts(d: Dimensions) -> tuple[Part, ...]:
    """Make every part of the finger, assembled in the sensor frame. Needs CadQuery.

    Args:
        d: Dimensions of the finger.

    Returns:
        The parts; of screws of one kind the first carries the quantity.

    Raises:
        SolidError: The kernel cannot make a part; the message names it.
    """
    return (
        body(d),
        cover(d),
        bezel(d),
        light_guide(d),
        gel_pad(d),
        mirror(d),
        mirror_seat(d),
        camera(d),
        camera_clamp(d),
        *led_boards(d),
        *shims(d),
        adapter(d),
        *screws(d),
    )


def tooling_parts(d: Dimensions, grid: MarkerGrid) -> tuple[Part, ...]:
    """Make moulds, templates, jigs, gauges and flat blanks. Needs CadQuery.

    The stencil is left out where `stencil_problem` names a reason, and the fabric skin where the
    spec wants none.

    Args:
        d: Dimensions of the finger.
        grid: Its markers, clipped to the gel's outline.

    Returns:
        The parts, each in a frame of its own.

    Raises:
        SolidError: The kernel cannot make a part; the message names it.
        ValueError: A dot crosses the gel's outline.
    """
    sheet = lay_out_stencil(grid, GelShape.of(d).outline)
    parts = [guide_blank(d), *mould_parts(d), cutting_template(d, sheet)]
    if not stencil_problem(grid):
        parts.append(stencil(sheet, grid))
    parts += [calibration_target(d), sphere_indenter(d), focus_jig(d), *fit_coupon(d)]
    if d["manufacturing.fabric_skin"]:
        parts.append(fabric_skin(d))
    return tuple(parts)
