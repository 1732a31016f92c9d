"""The meshes of the parts as the proof of the assembly moves them.

Bodies that touch or slide along each other share faces, and meshes of round ones differ from them
by the length of a chord. The moving bodies are therefore shrunk a little. An overlap that is
deeper than `SLACK_MM` is always found; one that is less deep counts as contact.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export.mesh import TriangleMesh, tessellate
from gelslim_cad.geometry.part import Part

Floats = NDArray[np.float64]
CHORD_MM = 0.01
"""Largest distance of a mesh from the surface of its part."""
ANGLE_DEG = 40.0
SHRINK_MM = 0.03
"""Largest way of a vertex of a moving body towards its inside."""
SLACK_MM = SHRINK_MM + 2 * CHORD_MM
"""An overlap of two parts that is deeper than this is always found."""
FACE_MM = SHRINK_MM / 3**0.5
"""Way of a face, so that no corner of a box moves by more than `SHRINK_MM`."""
FLAT = 0.02
"""Directions in which the normals around a vertex spread less than this are left as they are."""
LONGEST = 2.5
"""Limit of the way of a sharp corner over that of its faces."""
TAILED = ("camera_cable", "led_wire_")
TAIL_MM = 400.0
"""Cable and wires are this much longer than they are drawn."""


@dataclass(frozen=True)
class Bodies:
    """Meshes of parts by their names, and the directions in which their vertices are moved."""

    meshes: dict[str, TriangleMesh]
    outwards: dict[str, Floats]
    """Ways (n, 3) of the vertices that move all faces around them outwards by 1."""

    def corners_mm(self, name: str) -> Floats:
        """Corners (n, 3, 3) of the triangles of a part."""
        mesh = self.meshes[name]
        return mesh.vertices_mm[mesh.faces]

    def shrunk_mm(self, name: str) -> Floats:
        """The same of the part shrunk, for it to move past what it touches."""
        mesh = shrunk(self.meshes[name], self.outwards[name])
        return mesh.vertices_mm[mesh.faces]

    def grown_mm(self, name: str, gap_mm: float) -> Floats:
        """The same of the part with its faces moved outwards."""
        mesh = self.meshes[name]
        return (mesh.vertices_mm + gap_mm * self.outwards[name])[mesh.faces]


def part_meshes(parts: Iterable[Part]) -> dict[str, TriangleMesh]:
    """Meshes of parts by their names, within `CHORD_MM`.

    Raises:
        ExportError: A face could not be triangulated.
    """
    return {part.name: tessellate(part.solid, CHORD_MM, ANGLE_DEG) for part in parts}


def bodies(meshes: Mapping[str, TriangleMesh], tail_x_mm: float) -> Bodies:
    """The parts of a finger as the proof moves them.

    Args:
        meshes: Meshes of the parts where they are assembled, by name.
        tail_x_mm: Where cable and wires have left the finger and run straight on towards -x; they
            are drawn short there, with the cable's far connector behind it.

    Returns:
        The meshes. Cable and wires have long tails instead of ends: a way that is free for them
        needs no end to be threaded.
    """
    found = {
        name: with_tail(mesh, tail_x_mm) if name.startswith(TAILED) else mesh
        for name, mesh in meshes.items()
    }
    return Bodies(found, {name: outwards(mesh) for name, mesh in found.items()})


def with_tail(mesh: TriangleMesh, x_mm: float) -> TriangleMesh:
    """A mesh that runs straight on towards -x from where it crosses x; what was behind is gone."""
    behind = mesh.vertices_mm[:, 0] < x_mm
    kept = mesh.faces[~behind[mesh.faces].all(axis=1)]
    moved = mesh.vertices_mm.copy()
    moved[behind, 0] -= TAIL_MM
    return TriangleMesh(moved, kept)


def shrunk(mesh: TriangleMesh, ways: Floats) -> TriangleMesh:
    """A mesh whose faces are moved inwards by `FACE_MM`, but no vertex by more than `SHRINK_MM`.

    Args:
        mesh: A closed mesh.
        ways: What `outwards` gives for it.

    Returns:
        The smaller mesh; no point of its surface has moved by more than `SHRINK_MM`.
    """
    inwards = -FACE_MM * ways
    length = np.linalg.norm(inwards, axis=1)
    inwards *= np.minimum(1.0, SHRINK_MM / np.maximum(length, SHRINK_MM))[:, None]
    return TriangleMesh(mesh.vertices_mm + inwards, mesh.faces)


def outwards(mesh: TriangleMesh) -> Floats:
    """Ways (n, 3) of the vertices that move the faces of a closed mesh outwards by 1.

    The way x of a vertex solves n·x = 1 for the normals n of its triangles, by least squares where
    there are more than three; its length is limited to `LONGEST`, at sharp corners.
    """
    corners = mesh.vertices_mm[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normals, axis=1)
    normals = normals / np.where(size > 0, size, 1.0)[:, None]
    weighted = _angles(corners)[..., None] * normals[:, None, :]
    places, count = mesh.faces.ravel(), len(mesh.vertices_mm)
    products = (weighted[..., :, None] * normals[:, None, None, :]).reshape(-1, 9)
    matrix = _summed(places, products, count).reshape(-1, 3, 3)
    right = _summed(places, weighted.reshape(-1, 3), count)
    values, vectors = np.linalg.eigh(matrix)
    kept = values > FLAT * values[:, -1:]
    inverse = np.where(kept, 1.0 / np.where(kept, values, 1.0), 0.0)
    along = np.einsum("nji,nj->ni", vectors, right)
    ways = np.einsum("nij,nj->ni", vectors, inverse * along)
    length = np.linalg.norm(ways, axis=1)
    return np.asarray(ways * np.minimum(1.0, LONGEST / np.maximum(length, LONGEST))[:, None])


def _summed(places: NDArray[np.int64], values: Floats, count: int) -> Floats:
    """Sums (count, k) of rows (n, k) by their places."""
    return np.stack([np.bincount(places, v, count) for v in values.T], axis=1)


def _angles(corners: Floats) -> Floats:
    """Angles (n, 3) of triangles, which weigh the normals around a vertex."""
    sides = np.roll(corners, -1, axis=1) - corners
    sides = sides / np.maximum(np.linalg.norm(sides, axis=2), 1e-12)[..., None]
    inner = -np.einsum("nij,nij->ni", sides, np.roll(sides, 1, axis=1))
    return np.arccos(np.clip(inner, -1.0, 1.0))
