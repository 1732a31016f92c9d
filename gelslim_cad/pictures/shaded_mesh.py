"""A closed mesh with what pictures from any side need: normals, creases, and its outline.

All of it but the outline is independent of the view. It is found once for a mesh that many pictures
show.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
CREASE_DEG = 24.0
WELD_MM = 1e-5
"""Vertices that agree to this are one, so that every edge knows its two faces."""
EDGE_ON = 1e-9
"""Cosine of the angle between normal and view below which a face is seen from its edge."""


@dataclass(frozen=True)
class ShadedMesh:
    """A mesh as it is drawn.

    Attributes:
        vertices_mm: (n, 3).
        faces: (m, 3), counter-clockwise seen from outside.
        creases: (k, 2) ends of the edges where faces meet at more than `CREASE_DEG`, or end.
        folds: (j, 2) ends of all edges that join two faces.
        fold_normals: (j, 2, 3) unit normals of these faces.
        corners: (p,) vertex of each corner; a vertex on a crease has one for each of its sides.
        corner_normals: (p, 3) unit normals of the corners, for smooth shading.
        corner_faces: (m, 3), as `faces`, with corners instead of vertices.
    """

    vertices_mm: Floats
    faces: Indices
    creases: Indices
    folds: Indices
    fold_normals: Floats
    corners: Indices
    corner_normals: Floats
    corner_faces: Indices

    def outline(self, towards_viewer: Floats) -> Indices:
        """Edges (i, 2) between a face that is seen and one that is not, in parallel projection."""
        is_seen = self.fold_normals @ towards_viewer > EDGE_ON
        return self.folds[is_seen[:, 0] != is_seen[:, 1]]


def shaded_mesh(vertices_mm: ArrayLike, faces: ArrayLike) -> ShadedMesh:
    """Prepare a mesh: vertices (n, 3) in mm and faces (m, 3), counter-clockwise from outside."""
    points, triangles = _welded(np.asarray(vertices_mm, dtype=float), np.asarray(faces))
    normals = _face_normals(points, triangles)
    count = len(triangles)
    starts = triangles.ravel()
    ends = np.roll(triangles, -1, axis=1).ravel()
    edge = np.minimum(starts, ends) * len(points) + np.maximum(starts, ends)
    order = np.argsort(edge, kind="stable")
    _, first, used = np.unique(edge[order], return_index=True, return_counts=True)
    borders = order[first[used == 1]]
    one, two = order[first[used == 2]], order[first[used == 2] + 1]
    cosines = np.einsum("ij,ij->i", normals[one // 3], normals[two // 3])
    smooth = cosines > np.cos(np.radians(CREASE_DEG))
    sharp = np.concatenate([one[~smooth], borders])
    corner_faces = _corners(starts, one[smooth], two[smooth], count)
    corners = np.zeros(corner_faces.max(initial=-1) + 1, dtype=np.int64)
    corners[corner_faces.ravel()] = starts
    sums = np.zeros((len(corners), 3))
    np.add.at(sums, corner_faces.ravel(), np.repeat(normals, 3, axis=0))
    return ShadedMesh(
        vertices_mm=points,
        faces=triangles,
        creases=np.column_stack([starts[sharp], ends[sharp]]),
        folds=np.sort(np.column_stack([starts[one], ends[one]]), axis=1),
        fold_normals=np.stack([normals[one // 3], normals[two // 3]], axis=1),
        corners=corners,
        corner_normals=_unit(sums),
        corner_faces=corner_faces,
    )


def joined(meshes: Sequence[tuple[ShadedMesh, Floats]]) -> tuple[Floats, Floats, Indices]:
    """Corners (p, 3) in mm, their normals and faces (m, 3) of meshes with their shifts in mm."""
    points = [mesh.vertices_mm[mesh.corners] + shift for mesh, shift in meshes]
    starts = np.cumsum([0, *(len(p) for p in points[:-1])])
    faces = [mesh.corner_faces + s for (mesh, _), s in zip(meshes, starts, strict=True)]
    normals = [mesh.corner_normals for mesh, _ in meshes]
    return np.concatenate(points), np.concatenate(normals), np.concatenate(faces)


def _welded(points: Floats, faces: Indices) -> tuple[Floats, Indices]:
    """Vertices that agree are merged; triangles without an area are left out."""
    _, first, number = np.unique(
        np.round(points / WELD_MM), axis=0, return_index=True, return_inverse=True
    )
    merged = number.reshape(-1)[faces].astype(np.int64)
    a, b, c = merged.T
    return points[first], merged[(a != b) & (b != c) & (c != a)]


def _face_normals(points: Floats, faces: Indices) -> Floats:
    a, b, c = (points[faces[:, k]] for k in range(3))
    return _unit(np.cross(b - a, c - a))


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)


def _corners(starts: Indices, one: Indices, two: Indices, count: int) -> Indices:
    """Numbers (count, 3) of the corners of triangles, which triangles share along smooth edges.

    Args:
        starts: (3 count,) vertex at the start of each side of the triangles.
        one: Sides on smooth edges.
        two: The sides of the neighbouring triangles on the same edges.
        count: Number of triangles.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    def following(side: Indices) -> Indices:
        return side - side % 3 + (side + 1) % 3

    # Neighbours run along their common edge in opposite directions, unless one is inside out.
    same = starts[one] == starts[two]
    near, far = np.where(same, two, following(two)), np.where(same, following(two), two)
    a, b = np.concatenate([one, following(one)]), np.concatenate([near, far])
    links = coo_array((np.ones(len(a)), (a, b)), shape=(3 * count, 3 * count))
    _, numbers = connected_components(links, directed=False)
    return np.asarray(numbers, dtype=np.int64).reshape(-1, 3)
