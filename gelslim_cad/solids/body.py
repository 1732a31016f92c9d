"""The body: one printed tub that holds guide, chamber and mount.

mount  |   chamber    |  pocket (guide, view, LED channels)  | tip block, slot of a strip
======================+==roof==______ledge_______________ledge======
= slots=   camera     :     baffles on both sides            ======
======== cover ----------------------------------------------------
"""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.cable import groove, notch_end_x_mm, notch_top_z_mm
from gelslim_cad.solids.layout import Layout
from gelslim_cad.solids.led_seat import locating_edges, uncrushed_ribs
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
from gelslim_cad.solids.threads import film, roof_bosses, thread_cuts
from gelslim_cad.solids.tip_light import tip_ribs, tip_slot, uncrushed_tip_ribs

WEB_MM = 1.2
CHAMFER_MM = 0.5
FAR_MM = 1.0
FILMS_TOLD = "; open the four films over the bores of the bezel's screws with a knife"


def body(d: Dimensions) -> Part:
    """The printed body."""
    at = Layout(d)
    solid = single(_shell(d, at), "body")
    solid = chamfered(solid, _outer_top_edges(solid, at), CHAMFER_MM)
    walls = [*_inner_walls(d, at), *locating_edges(d)]
    solid = single(union([solid, *walls]), "body with its inner walls")
    solid = single(subtract(solid, _openings(d, at)), "body")
    ribs = tip_ribs(d)
    solid = single(union([solid, *ribs]), "body with the ribs at its tip") if ribs else solid
    process = d["manufacturing.print_process"]
    films = [film(at, hole) for hole in at.bezel_holes()] if process == "fdm" else []
    added = [*uncrushed_ribs(d), *uncrushed_tip_ribs(d), *films]
    return Part(
        name="body",
        solid=solid,
        material=PRINTED[process],
        process="print",
        colour=BODY,
        note="print black or paint the inside matt black" + (FILMS_TOLD if films else ""),
        print_rotation_deg=(180, 0, 0),
        printed=single(union([solid, *added]), "body as printed") if added else None,
    )


def _shell(d: Dimensions, at: Layout) -> cq.Shape:
    """Outer block without the space of cover, bezel, guide pocket and camera chamber."""
    half, wall = at.half_width_mm, d["design.housing.side_wall_mm"]
    tip, prox = d["finger.tip_x_mm"], d["finger.proximal_x_mm"]
    r = d["design.housing.corner_radius_mm"]
    cover, bezel_z = d["cover.top_z_mm"], d["stack.gel_bottom_z_mm"]
    block = rounded_box((prox, tip), (-half, half), (at.back_z_mm, at.top_z_mm), (1, r, r, 1))
    over, fit = half + FAR_MM, d["design.housing.fit_clearance_mm"]
    pocket = at.pocket_x_mm
    inside = d["channel.outer_y_mm"]
    return subtract(
        block,
        [
            box((at.cover_x_mm - fit, tip + FAR_MM), (-over, over), (at.back_z_mm - FAR_MM, cover)),
            box(
                (bezel_end_x_mm(d), tip + FAR_MM),
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


def bezel_end_x_mm(d: Dimensions) -> float:
    """Step of the roof before which the bezel lies, with the gap of a sliding fit."""
    return float(d["bezel.proximal_x_mm"] - d["design.housing.fit_clearance_mm"])


def _outer_top_edges(solid: cq.Solid, at: Layout) -> list[cq.Edge]:
    """Edges around the body's outer top face, except the one at the bezel."""
    faces = [f for f in solid.Faces() if abs(f.Center().z - at.top_z_mm) < 1e-6]
    if len(faces) != 1:
        return []
    bezel_x = bezel_end_x_mm(at.d)
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
        *roof_bosses(at),
        box((at.beam_x_mm, d["ledge.edge_x_mm"]), (-flat, flat), ledge_z),
        box((d["ledge.distal_x_mm"], end + FAR_MM / 2), (-flat, flat), ledge_z),
        box((at.beam_x_mm, start), (-wall, wall), (window - low, window + FAR_MM / 2)),
        *pair((start - WEB_MM, start), (baffle_y[0], wall), web_z),
        *pair((start - WEB_MM / 2, end + FAR_MM / 2), baffle_y, (cover, d["baffle.top_z_mm"])),
    ]


def _openings(d: Dimensions, at: Layout) -> list[cq.Shape]:
    """Wire notches, tongue slots, groove of cable and wires, slot of a strip, screw holes."""
    start = at.pocket_x_mm[0]
    cover, prox = d["cover.top_z_mm"], d["finger.proximal_x_mm"]
    fit = d["design.housing.fit_clearance_mm"]
    tongue_end = prox + d["design.mount.tongue_length_mm"] + fit
    slot_y = (d["tongue.inner_y_mm"] - fit, d["tongue.outer_y_mm"] + fit)
    channel = (d["channel.inner_y_mm"], d["channel.outer_y_mm"])
    notch_x = (notch_end_x_mm(d) - FAR_MM / 2, start + 0.01)
    return [
        *pair(notch_x, channel, (cover - FAR_MM, notch_top_z_mm(d))),
        *pair((prox - FAR_MM, tongue_end), slot_y, at.slot_z_mm),
        *groove(d),
        *tip_slot(d),
        *(cut for hole in (*at.bezel_holes(), *at.cover_holes()) for cut in thread_cuts(at, hole)),
        *_bolt_holes(d, at),
    ]


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
