"""Closed triangle meshes of solids, for printing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export.patch import Key, Patch, face_patches


class TriangleMesh(NamedTuple):
    """`vertices_mm (n,3)` and `faces (m,3)`, counter-clockwise seen from outside."""

    vertices_mm: NDArray[np.float64]
    faces: NDArray[np.int64]


def tessellate(shape: Any, linear_mm: float, angular_deg: float) -> TriangleMesh:
    """Mesh a copy of a solid, so that no tessellation leaks from one export to the next.

    `linear_mm` bounds the distance from chord to curve, `angular_deg` the turn between
    neighbouring chords. Vertices are welded by topology, not by distance: the mesh of a solid
    is closed wherever OCCT meshed the two sides of an edge alike.

    Raises:
        ExportError: a tolerance is not positive, or a face could not be triangulated.
    """
    return welded(face_patches(shape, linear_mm, angular_deg))


def welded(patches: Sequence[Patch]) -> TriangleMesh:
    """Join patches where their keys agree; drop what that or float32 collapses."""
    index: dict[Key, int] = {}
    points: list[NDArray[np.float64]] = []
    faces = []
    for patch in patches:
        numbers = np.empty(len(patch.keys), dtype=np.int64)
        for node, key in enumerate(patch.keys):
            if key not in index:
                index[key] = len(points)
                points.append(patch.nodes_mm[node])
            numbers[node] = index[key]
        faces.append(numbers[patch.triangles])
    return stored(TriangleMesh(np.array(points), np.concatenate(faces)))


def stored(mesh: TriangleMesh) -> TriangleMesh:
    """Round vertices to what a file can hold (float32) and merge those that become equal.

    A reader of STL merges equal vertices; doing so first lets the collapsed triangles go while
    the mesh is still known to be closed.
    """
    rounded = np.asarray(mesh.vertices_mm, dtype=np.float32).astype(np.float64) + 0.0
    points, merged = np.unique(rounded, axis=0, return_inverse=True)
    faces = merged.reshape(-1)[mesh.faces]
    a, b, c = faces.T
    faces = _without_folds(faces[(a != b) & (b != c) & (c != a)])
    used, compact = np.unique(faces, return_inverse=True)
    return TriangleMesh(points[used], compact.reshape(-1, 3).astype(np.int64))


def _without_folds(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Remove pairs of triangles on the same three vertices that face each other."""
    _, same, counts = np.unique(
        np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    same = same.reshape(-1)
    return faces[counts[same] == 1] if (counts > 1).any() else faces


def bad_edges(mesh: TriangleMesh) -> NDArray[np.int64]:
    """Edges `(k,2)`, as vertex numbers, that are not used exactly once each way.

    They border a hole, join triangles that face apart, or are where a solid touches itself.
    """
    count = len(mesh.vertices_mm)
    starts, ends = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    edges = np.minimum(starts, ends) * count + np.maximum(starts, ends)
    edges, place = np.unique(edges, return_inverse=True)
    ways = [np.bincount(place[way], minlength=len(edges)) for way in (starts < ends, starts > ends)]
    bad = edges[(ways[0] != 1) | (ways[1] != 1)]
    return np.column_stack([bad // count, bad % count])


def volume_mm3(mesh: TriangleMesh) -> float:
    """Volume inside a closed mesh, positive if it faces outwards (divergence theorem)."""
    corners = mesh.vertices_mm[mesh.faces] - mesh.vertices_mm.mean(axis=0)
    return float(np.linalg.det(corners).sum() / 6.0)


def area_mm2(mesh: TriangleMesh) -> float:
    """Total area of the triangles."""
    a, b, c = np.moveaxis(mesh.vertices_mm[mesh.faces], 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0)
