"""All parts of the finger, and all tooling that it is made with."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.part import Part
from gelslim_cad.markers.stencil import lay_out_frame, lay_out_stencil
from gelslim_cad.solids.adapter import adapter
from gelslim_cad.solids.bezel import bezel, bezel_blank, shims
from gelslim_cad.solids.body import body
from gelslim_cad.solids.cable import cable_pad, camera_cable
from gelslim_cad.solids.camera import camera
from gelslim_cad.solids.clamp import camera_clamp
from gelslim_cad.solids.cover import cover
from gelslim_cad.solids.explode import spread
from gelslim_cad.solids.gel import gel_pad
from gelslim_cad.solids.guide import guide_blank, led_boards, light_guide
from gelslim_cad.solids.mirror import mirror, mirror_seat
from gelslim_cad.solids.own_parts import with_own_parts
from gelslim_cad.solids.reuse import Maker, PartStore
from gelslim_cad.solids.screws import screws
from gelslim_cad.solids.threads import thread_parts
from gelslim_cad.solids.tooling.bending import bending_former, trim_jig
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
from gelslim_cad.solids.wires import led_wires
from gelslim_cad.spec.parts import OwnPart, own_parts
from ifem_export.markers.grid import MarkerGrid

MAKERS: tuple[Maker, ...] = (
    body,
    cover,
    bezel,
    light_guide,
    gel_pad,
    mirror,
    mirror_seat,
    camera,
    camera_clamp,
    camera_cable,
    cable_pad,
    led_boards,
    led_wires,
    shims,
    adapter,
    screws,
    thread_parts,
)
"""What makes the parts of a finger, in the order of the bill of materials."""


def finger_parts(
    d: Dimensions, own: Iterable[OwnPart] | None = None, store: PartStore | None = None
) -> tuple[Part, ...]:
    """Make every part of the finger, assembled in the sensor frame. Needs CadQuery.

    Args:
        d: Dimensions of the finger.
        own: Parts of the author's own, as `LoadedSpec.own_parts` has them; by default those of the
            spec with paths relative to the current folder. Python files among them are run.
        store: Parts of earlier calls, of which those whose dimensions did not change are taken.

    Returns:
        The parts; of screws of one kind the first carries the quantity.

    Raises:
        SolidError: The kernel cannot make a part; the message names it.
        InputError: A part of the author's own cannot be used.
    """
    built_in = (store or PartStore()).parts(d, MAKERS)
    return spread(with_own_parts(built_in, d, _own(d) if own is None else own))


def _own(d: Dimensions) -> tuple[OwnPart, ...]:
    named = {path.removeprefix("parts."): v for path, v in d.given.items() if "parts." in path}
    return own_parts({name: text for name, text in named.items() if text is not None}, Path())


def tooling_parts(d: Dimensions, grid: MarkerGrid | None) -> tuple[Part, ...]:
    """Make moulds, templates, jigs, gauges and flat blanks. Needs CadQuery.

    The stencil is made where the spec marks with one, unless `stencil_problem` names a reason; the
    fabric skin is left out where the spec wants none.

    Args:
        d: Dimensions of the finger.
        grid: Its markers, clipped to the gel's outline; None for a gel without.

    Returns:
        The parts, each in a frame of its own.

    Raises:
        SolidError: The kernel cannot make a part; the message names it.
        ValueError: A dot crosses the gel's outline.
    """
    outline = GelShape.of(d).outline
    sheet = lay_out_frame(outline) if grid is None else lay_out_stencil(grid, outline)
    parts = [guide_blank(d), *mould_parts(d), cutting_template(d, sheet)]
    if d["design.housing.bezel_material"] != "printed" and d["parts.tip_bezel"] is None:
        parts.append(bezel_blank(d))
    by_stencil = d["manufacturing.marking_process"] == "stencil"
    if by_stencil and grid is not None and not stencil_problem(grid):
        parts.append(stencil(sheet, grid))
    parts += [bending_former(d), trim_jig(d)]
    parts += [calibration_target(d), sphere_indenter(d), focus_jig(d), *fit_coupon(d)]
    if d["manufacturing.fabric_skin"]:
        parts.append(fabric_skin(d))
    return tuple(parts)
