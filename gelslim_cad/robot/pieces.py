"""Meshes of the finger for simulators: what is seen, by colour, and convex pieces that collide."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export.glb import LINEAR_MM, viewer_tolerances
from gelslim_cad.export.mesh import TriangleMesh, stored, tessellate, volume_mm3
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.part import Part

ADAPTER = "gripper_adapter"
GEL = "gel_pad"
CABLE = "camera_cable"
LEAST_PIECE_MM = 0.05
"""A slice of the adapter that is thinner than this is no piece."""
Colour = tuple[float, float, float, float]


@dataclass(frozen=True)
class Piece:
    """A named mesh of the finger.

    Attributes:
        name: Name, which is also that of its file.
        mesh: Triangles, counter-clockwise from outside, in mm.
        colour: sRGB colour with opacity.
        volume_mm3: Volume inside the mesh.
    """

    name: str
    mesh: TriangleMesh
    colour: Colour
    volume_mm3: float


def part_meshes(parts: Sequence[Part]) -> dict[str, TriangleMesh]:
    """Meshes of parts by their names, from which all pieces are made: as fine as a viewer's.

    Masses do not depend on them.
    """
    return {part.name: tessellate(part.solid, *viewer_tolerances(part)) for part in parts}


def visual_pieces(
    parts: Sequence[Part], meshes: Mapping[str, TriangleMesh], origin_mm: NDArray[np.float64]
) -> tuple[Piece, ...]:
    """One mesh for each colour of the finger, named after its first part, about `origin_mm`.

    `meshes` are those of the parts, as `part_meshes` gives them.
    """
    groups: dict[Colour, list[Part]] = {}
    for part in parts:
        groups.setdefault(part.colour, []).append(part)
    pieces = []
    for colour, group in groups.items():
        mesh = _joined([meshes[part.name] for part in group], origin_mm)
        pieces.append(Piece(f"visual_{group[0].name}", mesh, colour, volume_mm3(mesh)))
    return tuple(pieces)


def collision_pieces(
    parts: Sequence[Part],
    meshes: Mapping[str, TriangleMesh],
    gel: GelShape,
    origin_mm: NDArray[np.float64],
    cuts_x_mm: Sequence[float],
) -> tuple[Piece, ...]:
    """Convex hulls that together are the outside of the finger, about `origin_mm`.

    `meshes` are those of the parts, as `part_meshes` gives them. The case is one piece: what is
    within it cannot be touched, and cable and wires, which leave it, yield. The gel is one of
    its own, with a flat top where it is crowned (`crown_top_mm`). The adapter is cut at
    `cuts_x_mm`, rising positions along the finger, into pieces whose hulls follow it; what lies
    beyond the last cut, its tongues, is inside the case.
    """
    inside = [p for p in parts if p.name not in (ADAPTER, GEL, CABLE) and "wire" not in p.tags]
    points = {"case": np.concatenate([meshes[p.name].vertices_mm for p in inside])}
    for part in parts:
        if part.name == GEL:
            points["gel"] = np.concatenate([meshes[part.name].vertices_mm, crown_top_mm(gel)])
        elif part.name == ADAPTER:
            points |= _slices(meshes[part.name], cuts_x_mm)
    pieces = []
    for name, found in points.items():
        hull = convex_hull(found - origin_mm)
        pieces.append(Piece(f"collision_{name}", hull, (0.5, 0.5, 0.5, 0.4), volume_mm3(hull)))
    return tuple(pieces)


def crown_top_mm(gel: GelShape) -> NDArray[np.float64]:
    """Corners of the flat rectangle that stands for the top of a crowned gel.

    A simulator takes the points where a flat object touches from one face of the hull. A face of
    the tessellated crown is a triangle to one side of the middle, so the object tilts from face to
    face and never rests. On the rectangle it rests on four points about the middle, as on a flat
    gel. It is a square unless the gel is narrower.

    Args:
        gel: Shape of the gel.

    Returns:
        Points (4, 3) in the sensor frame, in the plane of the apex, no more than LINEAR_MM above
        the gel and inside its outline; (0, 3) for a flat gel.
    """
    if not gel.crown_mm:
        return np.zeros((0, 3))
    half = gel.rim_mm * math.sqrt(LINEAR_MM / (2 * gel.crown_mm))
    x, y = np.minimum(half, gel.inset_corner_mm(0.0))
    return np.array([[x, y, 0.0], [-x, y, 0.0], [-x, -y, 0.0], [x, -y, 0.0]])


def convex_hull(points_mm: NDArray[np.float64]) -> TriangleMesh:
    """Convex hull of points (n, 3), its triangles counter-clockwise from outside."""
    from scipy.spatial import ConvexHull

    rounded = np.asarray(points_mm, dtype=np.float32).astype(np.float64)
    hull = ConvexHull(rounded)
    a, b, c = (rounded[hull.simplices[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces = hull.simplices.astype(np.int64)
    faces[inward] = faces[inward][:, [0, 2, 1]]
    return stored(TriangleMesh(rounded, faces))


def _slices(mesh: TriangleMesh, cuts_x_mm: Sequence[float]) -> dict[str, NDArray[np.float64]]:
    """Points of the adapter between neighbouring cuts, those on the cuts among them."""
    from trimesh.intersections import slice_faces_plane

    limits = (-np.inf, *cuts_x_mm)
    pieces = {}
    for number in range(len(cuts_x_mm)):
        vertices, faces = mesh.vertices_mm, mesh.faces
        for normal, x in ((1.0, limits[number]), (-1.0, limits[number + 1])):
            if np.isfinite(x) and len(faces):
                vertices, faces, _ = slice_faces_plane(
                    vertices, faces, np.array([normal, 0.0, 0.0]), np.array([x, 0.0, 0.0])
                )
        used = vertices[np.unique(faces)] if len(faces) else np.zeros((0, 3))
        if len(used) and np.ptp(used, axis=0).min() > LEAST_PIECE_MM:
            pieces["flange" if number == len(cuts_x_mm) - 1 else "plate"] = used
    return pieces


def _joined(meshes: Iterable[TriangleMesh], origin_mm: NDArray[np.float64]) -> TriangleMesh:
    points, faces, count = [], [], 0
    for mesh in meshes:
        points.append(mesh.vertices_mm - origin_mm)
        faces.append(mesh.faces + count)
        count += len(mesh.vertices_mm)
    return TriangleMesh(np.concatenate(points), np.concatenate(faces))
