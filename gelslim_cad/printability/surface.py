"""Facets of a mesh as it stands on the plate: normals, areas, neighbours, points on them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export.mesh import TriangleMesh

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]


@dataclass(frozen=True)
class Surface:
    """A closed mesh, mm, z up, its lowest point on z = 0."""

    mesh: TriangleMesh

    @cached_property
    def corners_mm(self) -> Array:
        """Corners of the facets (m, 3, 3)."""
        return self.mesh.vertices_mm[self.mesh.faces]

    @cached_property
    def _crosses(self) -> Array:
        sides = self.corners_mm[:, 1:] - self.corners_mm[:, :1]
        return np.cross(sides[:, 0], sides[:, 1])

    @cached_property
    def areas_mm2(self) -> Array:
        """Areas of the facets (m,)."""
        return np.asarray(np.linalg.norm(self._crosses, axis=1) / 2)

    @cached_property
    def normals(self) -> Array:
        """Unit normals of the facets (m, 3), out of the part."""
        length = np.linalg.norm(self._crosses, axis=1, keepdims=True)
        return np.asarray(self._crosses / np.where(length > 0, length, 1.0))

    @cached_property
    def edges(self) -> tuple[Numbers, Numbers]:
        """Edges as pairs of facets (k, 2) and pairs of vertices (k, 2), each once."""
        faces = self.mesh.faces
        starts, ends = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        owner = np.repeat(np.arange(len(faces)), 3)
        low, high = np.minimum(starts, ends), np.maximum(starts, ends)
        order = np.lexsort((owner, high, low))
        pairs = owner[order].reshape(-1, 2)
        first = order[::2]
        return pairs, np.column_stack([low[first], high[first]])

    def opposite_mm(self, facets: Numbers, edges: Numbers) -> Array:
        """Corner of each facet that is not on its edge (k, 3)."""
        corner = self.mesh.faces[facets].sum(axis=1) - edges.sum(axis=1)
        return np.asarray(self.mesh.vertices_mm[corner])

    def samples(self, count: int, seed: int) -> tuple[Array, Numbers]:
        """Points spread evenly over the area (n, 3), and the facet of each (n,)."""
        rng = np.random.default_rng(seed)
        share = np.cumsum(self.areas_mm2)
        places = (np.arange(count) + rng.random(count)) / count * share[-1]
        facets = np.minimum(np.searchsorted(share, places), len(share) - 1)
        return points_on(self.corners_mm[facets], rng), facets


def points_on(corners_mm: Array, rng: np.random.Generator) -> Array:
    """A random point on each triangle; evenly distributed (Osada et al. 2002)."""
    root, second = np.sqrt(rng.random(len(corners_mm))), rng.random(len(corners_mm))
    weights = np.column_stack([1 - root, root * (1 - second), root * second])
    return np.asarray(np.einsum("nk,nkd->nd", weights, corners_mm))
