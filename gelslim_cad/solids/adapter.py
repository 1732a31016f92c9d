"""Gripper adapter: a flange against the gripper with two tongues inside the finger.

A jaw that looks along the finger takes the flange itself, below the finger's back. A jaw that
looks at the object takes a plate that stands on the flange, towards the gripper:

    axial   |===== finger          lateral        |===== finger
            |=====                         _______|=====
         jaw|                             |plate  |
                                            jaw
"""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.jaw import JawBolts
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.cable import flange_slot
from gelslim_cad.solids.layout import Layout
from gelslim_cad.solids.materials import ADAPTER, PRINTED
from gelslim_cad.solids.shapes import box, pair, rod, single, subtract, union

THROUGH_MM = 1.0
"""How far a drill starts before a face and ends behind it."""


def adapter(d: Dimensions) -> Part:
    """The printed or milled adapter."""
    at, bolts = Layout(d), JawBolts.of_design(d)
    prox, thick = d["finger.proximal_x_mm"], d["flange.thickness_mm"]
    half, low = d["flange.width_mm"] / 2, d["flange.jaw_z_mm"] - d["flange.foot_mm"] / 2
    tongue_z = (
        d["tongue.z_mm"] - d["design.mount.tongue_thickness_mm"] / 2,
        d["tongue.z_mm"] + d["design.mount.tongue_thickness_mm"] / 2,
    )
    solid = union(
        [
            box((prox - thick, prox), (-half, half), (low, at.top_z_mm)),
            *([_lateral_plate(d, bolts)] if bolts.lateral else []),
            *pair(
                (prox - thick / 2, prox + d["design.mount.tongue_length_mm"]),
                (d["tongue.inner_y_mm"], d["tongue.outer_y_mm"]),
                tongue_z,
            ),
        ]
    )
    cuts: list[cq.Shape] = [flange_slot(d)]
    cuts += [
        rod(
            at.bolt_x_mm(),
            s * at.tongue_y_mm,
            (tongue_z[0] - 1, tongue_z[1] + 1),
            at.bolt.clearance_mm,
        )
        for s in (-1, 1)
    ]
    cuts += _jaw_holes(d, bolts)
    return Part(
        name="gripper_adapter",
        solid=single(subtract(solid, cuts), "gripper_adapter"),
        material=PRINTED[d["manufacturing.print_process"]],
        process="print",
        colour=ADAPTER,
        explode_mm=(-30, 0, 0),
        note=_note(d, bolts),
        print_rotation_deg=(0, -90, 0),
    )


def _lateral_plate(d: Dimensions, bolts: JawBolts) -> cq.Solid:
    """Plate on a jaw that looks at the object, as long as the jaw."""
    behind = d["finger.proximal_x_mm"] - d["flange.thickness_mm"]
    half = float(bolts.plate_width_mm) / 2
    face = d["flange.jaw_z_mm"]
    return box(
        (behind - bolts.plate_depth_mm, d["finger.proximal_x_mm"]),
        (-half, half),
        (face, face + d["flange.thickness_mm"]),
    )


def _jaw_holes(d: Dimensions, bolts: JawBolts) -> list[cq.Shape]:
    """Holes of bolts and dowel pins, square to the face of the jaw."""
    in_jaw = bolts.gripper.jaw.thread == "jaw"
    diameter = bolts.size.clearance_mm if in_jaw else bolts.size.pilot_mm
    holes = [(y, u, diameter) for y, u in bolts.places_mm] + list(bolts.gripper.jaw.pins_mm)
    behind = d["finger.proximal_x_mm"] - d["flange.thickness_mm"]
    length = d["flange.thickness_mm"] + 2 * THROUGH_MM
    drilled: list[cq.Shape] = []
    for y, u, size in holes:
        if bolts.lateral:
            x = behind - bolts.plate_depth_mm / 2 + u
            start, along = (x, y, d["flange.jaw_z_mm"] - THROUGH_MM), (0, 0, 1)
        else:
            start, along = (behind - THROUGH_MM, y, d["flange.jaw_z_mm"] + u), (1, 0, 0)
        drilled.append(
            cq.Solid.makeCylinder(size / 2, length, cq.Vector(*start), cq.Vector(*along))
        )
    return drilled


def _note(d: Dimensions, bolts: JawBolts) -> str:
    gripper = bolts.gripper
    given = d["design.mount.flange_bolt_spacing_mm"] is not None
    known = given or d["design.mount.gripper"] == "generic" or not gripper.places_assumed
    measure = "" if known else "; places of the bolts are assumed, measure them before you print"
    return (
        f"for {gripper.name} with {len(bolts.places_mm)} × {bolts.bolt}{measure}; swap it to "
        "change gripper"
    )
