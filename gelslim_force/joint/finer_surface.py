"""The heights of the surface at half the pitch of the nodes, as the light sees them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.node_lattice import NodeLattice

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Nodes = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class FinerSurface:
    """The nodes and the places half way between them.

    Attributes:
        lattice: Of half the pitch, with f places.
        interpolation: (f, c) from the heights of the nodes.
        stencil: (2r + 1, 2r + 1, 3) height that the force on a node adds, in mm/N; see
            `ifem_export.compliance.finer_response`.
        place: (c, 2) of the nodes on the finer lattice.
    """

    lattice: NodeLattice
    interpolation: Any
    stencil: Array
    place: Nodes

    @classmethod
    def of(cls, nodes: NodeLattice, stencil: Array) -> FinerSurface:
        """In the cells and on the edges of a lattice that have all their nodes."""
        held = nodes.number >= 0
        finer = np.zeros([2 * n - 1 for n in held.shape], dtype=bool)
        finer[::2, ::2] = held
        finer[1::2, ::2] = held[1:] & held[:-1]
        finer[::2, 1::2] = held[:, 1:] & held[:, :-1]
        finer[1::2, 1::2] = finer[1::2, :-1:2] & finer[1::2, 2::2]
        points = nodes.origin_mm + np.argwhere(finer) * nodes.step_mm / 2
        lattice = NodeLattice.of(points, nodes.step_mm / 2)
        return cls(lattice, nodes.interpolation(points), stencil, 2 * nodes.place)

    def heights(self, height_mm: Array, nodes: Nodes, force_n: Array) -> Array:
        """Heights (f,) by those of all nodes (c,) and the forces (p, 3) on some of them (p,)."""
        from gelslim_force.joint.kernels.light_kernel import add_stencils

        found = np.ascontiguousarray(self.interpolation @ height_mm)
        force = np.ascontiguousarray(force_n, dtype=float)
        add_stencils(self.stencil, self.place[nodes], force, self.lattice.number, found)
        return found

    def seen(
        self, near: Mask, moved_mm: Array, force_n: Array, known_mm: Array | None = None
    ) -> tuple[NodeLattice, Array]:
        """The finer lattice, and its heights by motion and forces (c, 3) of the nodes.

        Forces count on the nodes `near` (c,) only. Heights (f,) that are known are taken as such.
        """
        if known_mm is not None:
            return self.lattice, known_mm
        nodes = np.flatnonzero(near)
        return self.lattice, self.heights(moved_mm[:, 2], nodes, force_n[nodes])
