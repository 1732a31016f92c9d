"""Normal forces at half the pitch of the nodes: what moves under a pressure that ends anywhere.

A force on a place half way between nodes splits evenly on the nodes of its cell or edge, with the
same resultant and moments, and moves the surface as these do, and as a stencil about its place.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.finer_surface import FinerSurface
from gelslim_force.joint.responses import Responses

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]
Nodes = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class PressureParts:
    """Unknown forces of a contact: q normal ones at half the pitch, and tangential ones on nodes.

    Attributes:
        nodes: (p,) that bear some of the forces, all with tangential ones.
        places: (f,) with normal forces.
        source: (f, 4) numbers of the unknown normal forces whose mean that on a place is. Between
            nodes inside a contact it follows from these; elsewhere all four are the same.
        own: (q,) the place of each unknown normal force, as an entry of `places`.
    """

    nodes: Nodes
    places: Nodes
    source: Nodes
    own: Nodes

    @property
    def size(self) -> int:
        """Number of unknown components, q + 2p."""
        return len(self.own) + 2 * len(self.nodes)

    @property
    def tangential(self) -> Nodes:
        """(2p,) numbers of the tangential forces among all unknown ones, x and y in turns."""
        return np.arange(len(self.own), self.size)

    def normal(self, unknown: Array) -> Array:
        """(f,) normal forces on the places by the unknown forces (q + 2p,)."""
        return np.asarray(unknown[self.source].mean(axis=1))


@dataclass(frozen=True, eq=False)
class FinerPressure:
    """Normal forces on the places of a finer surface.

    Attributes:
        surface: With f places for c nodes.
        stencils: (2, 2, 2r + 1, 2r + 1) in mm/N; see
            `ifem_export.compliance.finer_response.half_step_response`.
        corners: (f, 4) nodes that bear a quarter each of the force on a place; on an edge or a
            node, some of them are the same one.
    """

    surface: FinerSurface
    stencils: Array
    corners: Nodes

    @classmethod
    def of(cls, surface: FinerSurface, stencils: Array) -> FinerPressure:
        """On all places of a surface."""
        place, nodes = surface.lattice.place, surface.place
        number = np.full(nodes.max(axis=0) // 2 + 1, -1, dtype=np.intp)
        number[tuple((nodes // 2).T)] = np.arange(len(nodes))
        first, past = place // 2, (place + 1) // 2
        corners = [number[a[:, 0], b[:, 1]] for a in (first, past) for b in (first, past)]
        return cls(surface, stencils, np.stack(corners, axis=1))

    def about(self, nodes: Nodes) -> Nodes:
        """(q,) places whose force splits on one of the nodes (p,), or on more of them."""
        chosen = np.zeros(len(self.surface.place), dtype=bool)
        chosen[nodes] = True
        return np.flatnonzero(chosen[self.corners].any(axis=1))

    def between(self, places: Nodes, values: Array) -> Array:
        """(q,) values at places as means of those of the nodes (c,)."""
        return np.asarray(values[self.corners[places]].mean(axis=1))

    def forces(self, places: Nodes, force_n: Array) -> Array:
        """(q,) forces on places whose traction is that between nodes with normal forces (c,).

        Their sum is that of all normal forces.
        """
        found = self.between(places, force_n)
        total = float(found.sum())
        return np.asarray(found * (force_n.sum() / total if total else 0.0))

    def on_nodes(self, places: Nodes, force_n: Array) -> Array:
        """(c,) forces on the nodes by those on places (q,)."""
        corners = self.corners[places]
        share = np.repeat(force_n / corners.shape[1], corners.shape[1])
        count = len(self.surface.place)
        return np.asarray(np.bincount(corners.ravel(), share, count), dtype=float)

    def heights(self, moved: Array, tangential: tuple[Nodes, Array], normal: Any) -> Array:
        """Heights (f,) of all places.

        Args:
            moved: (c,) heights of the nodes.
            tangential: Nodes (p,) with forces (p, 2).
            normal: Places (q,) with normal forces (q,).
        """
        from gelslim_force.joint.kernels.light_kernel import add_stencils

        nodes, force = tangential
        found = self.surface.heights(moved, nodes, np.column_stack([force, np.zeros(len(nodes))]))
        places, normal_n = normal
        at, number = self.surface.lattice.place[places], self.surface.lattice.number
        for stencil, some in self._by_stencil(at):
            force = np.zeros((len(some), 3))
            force[:, 2] = normal_n[some]
            add_stencils(stencil, at[some], force, number, found)
        return found

    def by_force(self, responses: Responses, near: Nodes, parts: PressureParts) -> Single:
        """(m, q + 2p) heights of places `near` (m,) by the unknown forces.

        Args:
            responses: Of the nodes.
            near: (m,) places of the heights.
            parts: What is unknown.
        """
        from gelslim_force.joint.kernels.finer_kernel import (
            interpolated_rows,
            mark_columns,
            stencil_columns,
        )

        lattice, interpolation = self.surface.lattice, self.surface.interpolation
        entries = interpolation.indptr, interpolation.indices
        row = np.full(len(self.surface.place), -1, dtype=np.intp)
        mark_columns(*entries, near, row)
        seen = np.flatnonzero(row >= 0)
        row[seen] = np.arange(len(seen))
        rough = self.in_parts(responses.of_heights(parts.nodes, seen), parts)
        found = np.empty((len(near), parts.size), dtype=rough.dtype)
        interpolated_rows(*entries, interpolation.data, near, row, rough, found)
        seen_at, at = lattice.place[near], lattice.place[parts.places]
        alone = (parts.source == parts.source[:, :1]).all(axis=1)
        for stencil, some in self._by_stencil(at):
            for own, width in ((alone[some], 1), (~alone[some], 4)):
                which = some[own]
                columns = np.ascontiguousarray(parts.source[which, :width])
                stencil_columns(stencil[..., 2], at[which], seen_at, columns, found)
        at = self.surface.place[parts.nodes]
        for axis in (0, 1):
            columns = parts.tangential[axis::2, None]
            stencil = self.surface.stencil[..., axis]
            stencil_columns(stencil, at, seen_at, columns, found)
        return found

    def in_parts(self, rows: Any, parts: PressureParts) -> Any:
        """Columns (n, q + 2p) of the unknown forces by those (n, 3p) of forces on `nodes`."""
        from gelslim_force.joint.kernels.finer_kernel import columns_in_parts

        corners = np.searchsorted(parts.nodes, self.corners[parts.places])
        found = np.empty((len(rows), parts.size), dtype=rows.dtype)
        columns_in_parts(rows, corners, parts.source, found)
        return found

    def parts(self, nodes: Nodes, inner: Mask) -> PressureParts:
        """Unknown forces about nodes (n,), of which those marked in (c,) are inside the contact."""
        places, number = self.about(nodes), np.zeros(len(inner), dtype=np.intp)
        corners, between = self.corners[places], self._between[places]
        follows = between & inner[corners].all(axis=1)
        sought = np.cumsum(~follows) - 1
        number[corners[~between, 0]] = sought[~between]
        source = np.where(follows[:, None], number[corners], sought[:, None])
        bearing = np.unique(np.concatenate([corners.ravel(), nodes]))
        return PressureParts(bearing, places, source, np.flatnonzero(~follows))

    @cached_property
    def _between(self) -> Mask:
        """(f,) places that are not on a node."""
        return np.asarray((self.surface.lattice.place % 2).any(axis=1))

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
