"""Camera mock-up."""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.materials import CAMERA
from gelslim_cad.solids.shapes import box, single


def placed(d: Dimensions, local: cq.Shape) -> cq.Shape:
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
            front - face,
            cq.Vector(face, 0, 0),
            cq.Vector(1, 0, 0),
        )
        shape = shape.fuse(lens)
    return Part(
        name="camera",
        solid=single(placed(d, shape), "camera"),
        material=d["camera.name"] + (", mono" if d["camera.picture"] == "mono" else ""),
        process="buy",
        colour=CAMERA,
        explode_mm=(0, 0, -26),
        note=f"unscrew the lens by {d['view.lens_travel_mm']:.2f} mm from infinity focus",
    )
