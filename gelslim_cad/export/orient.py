"""Print orientation: a part turned as it will be printed and set on the plate."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export.mesh import TriangleMesh, stored
from gelslim_cad.geometry.part import Part


def rotation(angles_deg: tuple[float, float, float]) -> NDArray[np.float64]:
    """Matrix `(3,3)` that turns about x, then y, then z of the fixed frame.

    Multiples of 90 degrees come out exact, so that a flat face stays flat on the plate.
    """
    radians = np.radians(angles_deg)
    cx, cy, cz = (_exact(c) for c in np.cos(radians))
    sx, sy, sz = (_exact(s) for s in np.sin(radians))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x, dtype=np.float64)


def _exact(value: float) -> float:
    nearest = float(np.round(value))
    return nearest if abs(value - nearest) < 1e-15 else float(value)


def print_mesh(mesh: TriangleMesh, angles_deg: tuple[float, float, float]) -> TriangleMesh:
    """Turn a mesh, centre its bounding box on the plate and put its lowest point at z = 0."""
    turned = mesh.vertices_mm @ rotation(angles_deg).T
    low, high = turned.min(axis=0), turned.max(axis=0)
    middle = (low + high) / 2.0
    return stored(TriangleMesh(turned - np.array([middle[0], middle[1], low[2]]), mesh.faces))


def print_shape(part: Part) -> Any:
    """The part's solid turned by `print_rotation_deg`, centred, its lowest point at z = 0."""
    import cadquery as cq

    from gelslim_cad.export.brep import bare_copy

    turned = bare_copy(part.solid)
    origin = cq.Vector(0, 0, 0)
    axes = (cq.Vector(1, 0, 0), cq.Vector(0, 1, 0), cq.Vector(0, 0, 1))
    for axis, angle in zip(axes, part.print_rotation_deg, strict=True):
        if angle:
            turned = turned.rotate(origin, axis, angle)
    low, high = bounds_mm(turned)
    middle = (low + high) / 2.0
    return bare_copy(turned.translate(cq.Vector(-middle[0], -middle[1], -low[2])))


def bounds_mm(shape: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Low and high corner `(3,)` of the tight bounding box, independent of any cached mesh."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape.wrapped, box, False, False)
    box.SetGap(0.0)
    corners = (box.CornerMin(), box.CornerMax())
    low, high = (np.array([c.X(), c.Y(), c.Z()]) for c in corners)
    return low, high
