"""Camera mock-up and the clamp that holds it at its pitch."""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.dimensions.fold_housing import CLAMP_BAR_MM, CLAMP_LIP_MM, LIP_GAP_MM
from gelslim_cad.dimensions.housing import CLAMP_CHEEK_MM
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.layout import Layout
from gelslim_cad.solids.materials import CAMERA, CLAMP, PRINTED
from gelslim_cad.solids.shapes import Point2, box, pair, rod, single, subtract, union

FAR_MM = 200.0
SCREW_DEPTH_MM = 5.0
LEAST_FLOOR_MM = 0.8
"""Thinner floors of the clamp are left out: there the cover is the floor."""


def _placed(d: Dimensions, local: cq.Shape) -> cq.Shape:
    """Move a shape from the camera's frame, entrance pupil at 0 and looking along +x."""
    turned = local.rotate(cq.Vector(), cq.Vector(0, 1, 0), d["camera_pose.pitch_deg"])
    return turned.translate(cq.Vector(d["camera_pose.x_mm"], 0, d["camera_pose.z_mm"]))


def camera(d: Dimensions) -> Part:
    """Camera housing and lens barrel, with the sizes of the data sheet."""
    face, depth = -d["camera_pose.face_mm"], d["camera.module_depth_mm"]
    front = d["camera_pose.lens_front_mm"]
    half_w, half_h = d["camera.module_width_mm"] / 2, d["camera.module_height_mm"] / 2
    shape: cq.Shape = box((face - depth, face), (-half_w, half_w), (-half_h, half_h))
    if face < front:
        lens = cq.Solid.makeCylinder(
            d["camera.lens_diameter_mm"] / 2,
            front - face + depth / 2,
            cq.Vector(face - depth / 2, 0, 0),
            cq.Vector(1, 0, 0),
        )
        shape = shape.fuse(lens)
    return Part(
        name="camera",
        solid=single(_placed(d, shape), "camera"),
        material=d["camera.name"] + (", mono" if d["camera.picture"] == "mono" else ""),
        process="buy",
        colour=CAMERA,
        explode_mm=(0, 0, -26),
        note=f"unscrew the lens by {d['view.lens_travel_mm']:.2f} mm from infinity focus",
    )


def clamp_screw_positions(d: Dimensions) -> list[Point2]:
    """Positions (x, y) of the screws that hold the clamp's cheeks from below."""
    middle = -d["camera_pose.face_mm"] - d["camera.module_depth_mm"] / 2
    x = _placed(d, cq.Vertex.makeVertex(middle, 0, -d["camera.module_height_mm"] / 2)).Center().x
    y = d["clamp.width_mm"] / 2 - CLAMP_CHEEK_MM / 2
    return [(x, -y), (x, y)]


def camera_clamp(d: Dimensions) -> Part:
    """Cradle of floor, two cheeks with front lips and a rear bar, open towards the gel."""
    at = Layout(d)
    fit = d["clamp.play_mm"]
    face = -d["camera_pose.face_mm"]
    rear = face - d["camera.module_depth_mm"] - fit
    inner = d["camera.module_width_mm"] / 2 + fit
    outer = inner + CLAMP_CHEEK_MM
    high = d["camera.module_height_mm"] / 2
    lens = d["camera.lens_diameter_mm"] / 2
    pieces: list[cq.Shape] = [
        *pair((rear - CLAMP_BAR_MM, face), (inner, outer), (-FAR_MM, high)),
        box((rear - CLAMP_BAR_MM, rear), (-outer, outer), (-FAR_MM, 0)),
    ]
    lip = min(CLAMP_LIP_MM, d["camera_pose.lens_front_mm"] - face - fit - LIP_GAP_MM)
    if lip > 0.4 and lens + fit < inner - 0.4:
        pieces += pair((face - 0.1, face + fit + lip), (inner, outer), (-FAR_MM, lens))
        pieces += pair((face + fit, face + fit + lip), (lens + fit, inner + 0.1), (-FAR_MM, lens))
    floor = box((rear - CLAMP_BAR_MM, face), (-outer, outer), (-high - fit - 0.1, -high - fit))
    if _placed(d, floor).BoundingBox().zmin - d["cover.top_z_mm"] > LEAST_FLOOR_MM:
        pieces.append(box((rear - CLAMP_BAR_MM, face), (-outer, outer), (-FAR_MM, -high - fit)))
    slab = box(
        (-FAR_MM, FAR_MM),
        (-FAR_MM, FAR_MM),
        (d["cover.top_z_mm"], d["stack.window_bottom_z_mm"] - 0.1),
    )
    cradle = _placed(d, union(pieces)).intersect(slab)
    holes = [
        rod(
            x,
            y,
            (d["cover.top_z_mm"] - 0.1, d["cover.top_z_mm"] + SCREW_DEPTH_MM),
            at.screw.pilot_mm,
        )
        for x, y in clamp_screw_positions(d)
    ]
    return Part(
        name="camera_clamp",
        solid=single(subtract(cradle, holes), "camera_clamp"),
        material=PRINTED[d["manufacturing.print_process"]],
        process="print",
        colour=CLAMP,
        explode_mm=(0, 0, -40),
        note="drop the camera in from the gel side; align it by its picture, then glue it",
    )
