"""Normal forces at half the pitch of the nodes: what moves under a pressure that ends anywhere.

A force on a place half way between nodes splits bilinearly on the nodes of its cell or edge, with
the same resultant and moments, and moves the surface as these do, and as a stencil about its place.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gelslim_force.joint.finer_surface import FinerSurface
from gelslim_force.joint.responses import Responses

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]
Nodes = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class FinerPressure:
    """Normal forces on the places of a finer surface.

    Attributes:
        surface: With f places for c nodes.
        stencils: (2, 2, 2r + 1, 2r + 1) in mm/N; see
            `ifem_export.compliance.finer_response.half_step_response`.
        split: (f, c) share of each node in the force on a place.
    """

    surface: FinerSurface
    stencils: Array
    split: Any

    @classmethod
    def of(cls, surface: FinerSurface, stencils: Array) -> FinerPressure:
        """On all places of a surface."""
        place, nodes = surface.lattice.place, surface.place
        number = np.full(nodes.max(axis=0) // 2 + 1, -1, dtype=np.intp)
        number[tuple((nodes // 2).T)] = np.arange(len(nodes))
        first, past = place // 2, (place + 1) // 2
        corners = [(a[:, 0], b[:, 1]) for a in (first, past) for b in (first, past)]
        columns = np.stack([number[corner] for corner in corners], axis=1).ravel()
        rows = np.repeat(np.arange(len(place)), len(corners))
        weight = np.full(len(rows), 1 / len(corners))
        size = (len(place), len(nodes))
        return cls(surface, stencils, sparse.csr_array((weight, (rows, columns)), shape=size))

    def about(self, nodes: Nodes) -> Nodes:
        """(q,) places whose force splits on one of the nodes (p,), or on more of them."""
        mask = np.zeros(self.split.shape[1])
        mask[nodes] = 1.0
        return np.flatnonzero(self.split @ mask)

    def forces(self, places: Nodes, force_n: Array) -> Array:
        """(q,) forces on places whose traction is that between nodes with normal forces (c,).

        Their sum is that of all normal forces.
        """
        found = self.split[places] @ force_n
        total = float(found.sum())
        return np.asarray(found * (force_n.sum() / total if total else 0.0))

    def heights(self, moved: Array, tangential: tuple[Nodes, Array], normal: Any) -> Array:
        """Heights (f,) of all places.

        Args:
            moved: (c,) heights of the nodes.
            tangential: Nodes (p,) with forces (p, 2).
            normal: Places (q,) with normal forces (q,).
        """
        from gelslim_force.joint.light_kernel import add_stencils

        nodes, force = tangential
        found = self.surface.heights(moved, nodes, np.column_stack([force, np.zeros(len(nodes))]))
        places, normal_n = normal
        at, number = self.surface.lattice.place[places], self.surface.lattice.number
        for stencil, some in self._by_stencil(at):
            force = np.zeros((len(some), 3))
            force[:, 2] = normal_n[some]
            add_stencils(stencil, at[some], force, number, found)
        return found

    def by_force(self, responses: Responses, near: Nodes, nodes: Nodes, places: Nodes) -> Single:
        """(m, q + 2p) heights of places by normal forces (q,) and tangential ones (p, 2).

        Args:
            responses: Of the nodes.
            near: (m,) places of the heights.
            nodes: (p,) with tangential forces.
            places: (q,) with normal forces.
        """
        from gelslim_force.joint.finer_kernel import stencil_columns

        lattice = self.surface.lattice
        split = self.split[places]
        bearing = np.unique(np.concatenate([split.indices, nodes]))
        interpolation = self.surface.interpolation[near]
        seen = np.unique(interpolation.indices)
        rough = in_parts(
            responses.of_heights(bearing, seen), split[:, bearing], np.searchsorted(bearing, nodes)
        )
        single = interpolation[:, seen].astype(np.float32)
        found = np.ascontiguousarray(single @ rough)
        number = np.full(len(lattice.place), -1, dtype=np.intp)
        number[near] = np.arange(len(near))
        at, count = lattice.place[places], len(places)
        for stencil, some in self._by_stencil(at):
            stencil_columns(stencil[..., 2], at[some], lattice.number, number, some, found)
        for axis in (0, 1):
            columns = count + 2 * np.arange(len(nodes)) + axis
            stencil = self.surface.stencil[..., axis]
            at = self.surface.place[nodes]
            stencil_columns(stencil, at, lattice.number, number, columns, found)
        return found

    @cached_property
    def _stencils(self) -> Array:
        """(2, 2, 2r + 1, 2r + 1, 3), by the force along each axis."""
        found = np.zeros((*self.stencils.shape, 3))
        found[..., 2] = self.stencils
        return found

    def _by_stencil(self, at: Nodes) -> list[tuple[Array, Nodes]]:
        """The stencils, and which of the places (q, 2) each of them is for."""
        return [
            (self._stencils[odd], np.flatnonzero((at % 2 == odd).all(axis=1)))
            for odd in np.ndindex(2, 2)
        ]


def in_parts(rows: Single, split: Any, tangential: Nodes) -> Single:
    """Columns (n, q + 2p) of forces at half the pitch by those of nodes.

    Args:
        rows: (n, 3r) by the forces on r nodes.
        split: (q, r) share of the nodes in each normal force.
        tangential: (p,) which of the nodes have tangential forces.
    """
    columns = np.add.outer(3 * tangential, (0, 1)).ravel()
    normal = (split.astype(np.float32) @ np.ascontiguousarray(rows[:, 2::3].T)).T
    return np.hstack([normal, rows[:, columns]])
