"""The space that the camera's view of the gel takes up, as solids; no part may lie in it.

It has two convex pieces, bounded by the exact rays to the gel's corners: from the pinhole to the
mirror, and from the mirror to the window's lower face.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import cadquery as cq
import numpy as np
from numpy.typing import NDArray

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.geometry.sight import virtual_camera
from gelslim_cad.solids.shapes import single

OPTICAL_PARTS = frozenset({"light_guide", "gel_pad", "mirror", "camera"})
"""Parts that bound the view or that the light passes through."""
INSET_MM = 0.02

Points = NDArray[np.float64]


def corner_rays(d: Dimensions) -> tuple[Points, Points, Points]:
    """Virtual pinhole (3,), and the points (4, 3) where the corner rays meet mirror and window."""
    camera = virtual_camera(d)
    x, y = d["design.gel.length_mm"] / 2, d["design.gel.width_mm"] / 2
    corners = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]], dtype=float)
    rays = camera.air_directions(corners)
    angle = math.radians(d["mirror.angle_deg"])
    normal = np.array([-math.sin(angle), 0, math.cos(angle)])
    on_mirror = np.array([d["mirror.lower_x_mm"], 0, d["mirror.lower_z_mm"]])
    start = camera.position_mm
    to_mirror = ((on_mirror - start) @ normal) / (rays @ normal)
    to_window = (camera.window_bottom_z_mm - start[2]) / rays[:, 2]
    return start, start + rays * to_mirror[:, None], start + rays * to_window[:, None]


def view_corridor(d: Dimensions) -> tuple[cq.Solid, cq.Solid]:
    """Pyramid from camera to mirror and frustum from mirror to window, inset by 0.02 mm."""
    _, mirror, window = corner_rays(d)
    pinhole = np.array([d["camera_pose.x_mm"], 0, d["camera_pose.z_mm"]])
    angle = math.radians(d["mirror.angle_deg"])
    lift = INSET_MM * np.array([-math.sin(angle), 0, math.cos(angle)])
    face, under = mirror + lift, window - np.array([0, 0, INSET_MM])
    pyramid = [[pinhole, face[k], face[(k + 1) % 4]] for k in range(4)]
    pyramid.append(list(face))
    frustum = [[face[k], face[(k + 1) % 4], under[(k + 1) % 4], under[k]] for k in range(4)]
    frustum += [list(face), list(under)]
    return _polyhedron(pyramid, "camera view"), _polyhedron(frustum, "gel view")


def _polyhedron(faces: Iterable[list[Points]], name: str) -> cq.Solid:
    planar = []
    for points in faces:
        # Triangles instead of quadrilaterals, whose four corners are not exactly coplanar.
        for k in range(1, len(points) - 1):
            loop = [cq.Vector(*points[0]), cq.Vector(*points[k]), cq.Vector(*points[k + 1])]
            planar.append(cq.Face.makeFromWires(cq.Wire.makePolygon([*loop, loop[0]])))
    shell = cq.Shell.makeShell(planar)
    solid = cq.Solid.makeSolid(shell)
    return single(solid.fix() if solid.Volume() < 0 else solid, name)


def blocked_volumes(d: Dimensions, parts: Iterable[Part]) -> dict[str, float]:
    """Volume in mm³ by which each part obstructs the view; empty when the view is free."""
    pieces = view_corridor(d)
    taken: dict[str, float] = {}
    for part in parts:
        if part.name in OPTICAL_PARTS:
            continue
        volume = sum(abs(part.solid.intersect(piece).Volume()) for piece in pieces)
        if volume > 1e-4:
            taken[part.name] = volume
    return taken
