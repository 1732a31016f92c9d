"""Gripper adapter: a flange against the gripper with two tongues inside the finger."""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.fasteners import SCREWS
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.layout import Layout
from gelslim_cad.solids.materials import ADAPTER, PRINTED
from gelslim_cad.solids.shapes import box, pair, rod, single, subtract, union

EDGE_MM = 2.0


def adapter(d: Dimensions) -> Part:
    """The printed or milled adapter."""
    at = Layout(d)
    flange_bolt = SCREWS[d["design.mount.flange_bolt"]]
    prox, thick = d["finger.proximal_x_mm"], d["design.mount.flange_thickness_mm"]
    pitch = d["design.mount.flange_bolt_spacing_mm"]
    foot = flange_bolt.cap_head_mm + 2 * EDGE_MM
    half = max(at.half_width_mm, pitch / 2 + flange_bolt.cap_head_mm / 2 + EDGE_MM)
    tongue_z = (
        d["tongue.z_mm"] - d["design.mount.tongue_thickness_mm"] / 2,
        d["tongue.z_mm"] + d["design.mount.tongue_thickness_mm"] / 2,
    )
    solid = union(
        [
            box((prox - thick, prox), (-half, half), (at.back_z_mm - foot, at.top_z_mm)),
            *pair(
                (prox - thick / 2, prox + d["design.mount.tongue_length_mm"]),
                (d["tongue.inner_y_mm"], d["tongue.outer_y_mm"]),
                tongue_z,
            ),
        ]
    )
    cable = d["camera.cable_width_mm"] / 2 + d["design.housing.fit_clearance_mm"]
    middle = d["tongue.z_mm"]
    cuts: list[cq.Shape] = [
        box((prox - thick - 1, prox + 1), (-cable, cable), (middle - 1.5, middle + 1.5))
    ]
    cuts += [
        rod(
            at.bolt_x_mm(),
            s * at.tongue_y_mm,
            (tongue_z[0] - 1, tongue_z[1] + 1),
            at.bolt.clearance_mm,
        )
        for s in (-1, 1)
    ]
    cuts += [
        cq.Solid.makeCylinder(
            flange_bolt.clearance_mm / 2,
            thick + 2,
            cq.Vector(prox - thick - 1, s * pitch / 2, at.back_z_mm - foot / 2),
            cq.Vector(1, 0, 0),
        )
        for s in (-1, 1)
    ]
    return Part(
        name="gripper_adapter",
        solid=single(subtract(solid, cuts), "gripper_adapter"),
        material=PRINTED[d["manufacturing.print_process"]],
        process="print",
        colour=ADAPTER,
        explode_mm=(-30, 0, 0),
        note=f"for {d['design.mount.gripper']}; swap it to change gripper",
        print_rotation_deg=(0, -90, 0),
    )
