"""The body: one printed tub that holds guide, chamber and mount.

mount  |   chamber    |  pocket (guide, view, LED channels)  | tip block
======================+==roof==______ledge_______________ledge======
= slots=   camera     :     baffles on both sides            ======
======== cover ----------------------------------------------------
"""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.layout import Hole, Layout
from gelslim_cad.solids.materials import BODY, PRINTED
from gelslim_cad.solids.shapes import (
    box,
    chamfered,
    pair,
    rod,
    rounded_box,
    single,
    subtract,
    union,
)

WEB_MM = 1.2
CHAMFER_MM = 0.5
FAR_MM = 1.0


def body(d: Dimensions) -> Part:
    """The printed body."""
    at = Layout(d)
    solid = single(_shell(d, at), "body")
    solid = chamfered(solid, _outer_top_edges(solid, at), CHAMFER_MM)
    solid = single(union([solid, *_inner_walls(d, at)]), "body with its inner walls")
    solid = single(subtract(solid, _openings(d, at)), "body")
    process = d["manufacturing.print_process"]
    return Part(
        name="body",
        solid=solid,
        material=PRINTED[process],
        process="print",
        colour=BODY,
        note="print black or paint the inside matt black",
        print_rotation_deg=(180, 0, 0),
    )


def _shell(d: Dimensions, at: Layout) -> cq.Shape:
    """Outer block without the space of cover, bezel, guide pocket and camera chamber."""
    half, wall = at.half_width_mm, d["design.housing.side_wall_mm"]
    tip, prox = d["finger.tip_x_mm"], d["finger.proximal_x_mm"]
    r = d["design.housing.corner_radius_mm"]
    cover, bezel_z = d["cover.top_z_mm"], d["stack.gel_bottom_z_mm"]
    block = rounded_box((prox, tip), (-half, half), (at.back_z_mm, at.top_z_mm), (1, r, r, 1))
    over = half + FAR_MM
    pocket = at.pocket_x_mm
    inside = d["channel.outer_y_mm"]
    return subtract(
        block,
        [
            box((at.cover_x_mm, tip + FAR_MM), (-over, over), (at.back_z_mm - FAR_MM, cover)),
            box(
                (d["bezel.proximal_x_mm"], tip + FAR_MM),
                (-over, over),
                (bezel_z, at.top_z_mm + FAR_MM),
            ),
            box(pocket, (-inside, inside), (cover - FAR_MM, bezel_z + FAR_MM)),
            box(
                (d["chamber.rear_x_mm"], pocket[0]),
                (wall - half, half - wall),
                (cover - FAR_MM, d["stack.window_bottom_z_mm"]),
            ),
        ],
    )


def _outer_top_edges(solid: cq.Solid, at: Layout) -> list[cq.Edge]:
    """Edges around the body's outer top face, except the one at the bezel."""
    faces = [f for f in solid.Faces() if abs(f.Center().z - at.top_z_mm) < 1e-6]
    if len(faces) != 1:
        return []
    bezel_x = at.d["bezel.proximal_x_mm"]
    edges: list[cq.Edge] = faces[0].outerWire().Edges()
    return [e for e in edges if abs(e.Center().x - bezel_x) > 1e-6]


def _inner_walls(d: Dimensions, at: Layout) -> list[cq.Shape]:
    """Ledges under the ends of the window, beam, baffles and the webs that support them."""
    low, shim = d["ledge.depth_mm"], d["shim.compressed_mm"]
    window, cover = d["stack.window_bottom_z_mm"], d["cover.top_z_mm"]
    flat = d["guide.flat_width_mm"] / 2
    start, end = at.pocket_x_mm
    wall = at.half_width_mm - d["design.housing.side_wall_mm"] / 2
    ledge_z = (window - low, window - shim)
    web_z = (cover, window + FAR_MM / 2)
    baffle_y = (d["baffle.inner_y_mm"], d["channel.inner_y_mm"])
    return [
        box((at.beam_x_mm, d["ledge.edge_x_mm"]), (-flat, flat), ledge_z),
        box((d["ledge.distal_x_mm"], end + FAR_MM / 2), (-flat, flat), ledge_z),
        box((at.beam_x_mm, start), (-wall, wall), (window - low, window + FAR_MM / 2)),
        *pair((start - WEB_MM, start), (baffle_y[0], wall), web_z),
        *pair((start - WEB_MM / 2, end + FAR_MM / 2), baffle_y, (cover, d["baffle.top_z_mm"])),
    ]


def _openings(d: Dimensions, at: Layout) -> list[cq.Shape]:
    """Wire notches, tongue slots, cable slot and screw holes."""
    start = at.pocket_x_mm[0]
    cover, prox = d["cover.top_z_mm"], d["finger.proximal_x_mm"]
    fit = d["design.housing.fit_clearance_mm"]
    tongue_end = prox + d["design.mount.tongue_length_mm"] + fit
    cable = d["design.housing.fit_clearance_mm"] + d["camera.cable_width_mm"] / 2
    slot_y = (d["tongue.inner_y_mm"] - fit, d["tongue.outer_y_mm"] + fit)
    channel = (d["channel.inner_y_mm"], d["channel.outer_y_mm"])
    rear, middle = d["chamber.rear_x_mm"], d["tongue.z_mm"]
    notch_x = (start - WEB_MM - FAR_MM / 2, start + 0.01)
    return [
        *pair(notch_x, channel, (cover - FAR_MM, d["led.top_z_mm"])),
        *pair((prox - FAR_MM, tongue_end), slot_y, at.slot_z_mm),
        box((prox - FAR_MM, rear + FAR_MM), (-cable, cable), (middle - 1.25, middle + 1.25)),
        *(_pilot(at, hole) for hole in (*at.bezel_holes(), *at.cover_holes())),
        *_bolt_holes(d, at),
    ]


def _pilot(at: Layout, hole: Hole) -> cq.Solid:
    """Threaded hole behind the clamped plate."""
    start = hole.surface_z_mm + hole.inward * (hole.plate_mm - 0.05)
    end = hole.surface_z_mm + hole.inward * (hole.plate_mm + hole.pilot_mm)
    span = (min(start, end), max(start, end))
    return rod(hole.x_mm, hole.y_mm, span, at.screw.pilot_mm)


def _bolt_holes(d: Dimensions, at: Layout) -> list[cq.Shape]:
    """Holes of the mount's cross bolts: head recessed in the back, thread above the tongue."""
    shapes: list[cq.Shape] = []
    low, high = at.slot_z_mm
    head = min(at.bolt.cap_height_mm + 0.2, (low - at.back_z_mm) - 1.0)
    for y in (-at.tongue_y_mm, at.tongue_y_mm):
        x = at.bolt_x_mm()
        shapes.append(rod(x, y, (at.back_z_mm - FAR_MM, low + 0.1), at.bolt.clearance_mm))
        if head > 0:
            shapes.append(
                rod(x, y, (at.back_z_mm - FAR_MM, at.back_z_mm + head), at.bolt.cap_head_mm + 0.4)
            )
        thread_top = high + max(0.5, min(6.0, at.top_z_mm - high - 1.0))
        shapes.append(rod(x, y, (high - 0.1, thread_top), at.bolt.pilot_mm))
    return shapes
