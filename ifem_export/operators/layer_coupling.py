"""What the surface of a pad and the nodes below it exert on each other.

Nodes with the same cells around them share their rows of the stiffness matrix. The few rows that
differ stay in the fastest cache, where the blocks of the assembled matrix are read anew for each
product and take several times as long.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ifem_export.assembly.occupancy_table import occupancy_table
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.symmetric_matrix import matrix_bytes

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]
BELOW, BESIDE, ABOVE = slice(0, 9), slice(9, 18), slice(18, 27)
"""Slots of `occupancy_table` by the layer of the neighbour."""


@dataclass(frozen=True, eq=False)
class Stencil:
    """Rows of the stiffness matrix of nodes that have few kinds of surroundings.

    Attributes:
        types: (c,) kind of each node.
        neighbours: (c, k) rows of the motion of each node's neighbours.
        blocks: (t, 3, 3, k) by kind, in N/mm.
    """

    types: Numbers
    neighbours: Numbers
    blocks: Array

    def force(self, moved_mm: Array) -> Array:
        """Forces (c, 3) in N for motions (m, 3) in mm, of which absent neighbours have zeros."""
        from ifem_export.operators.surface_kernel import apply_stencil

        found = np.empty((len(self.types), 3))
        apply_stencil(self.types, self.neighbours, self.blocks, moved_mm, found)
        return found

    @property
    def n_bytes(self) -> int:
        """Bytes of all arrays."""
        return int(self.types.nbytes + self.neighbours.nbytes + self.blocks.nbytes)


class Coupling(Protocol):
    """Products with the blocks of a pad's stiffness that hold its surface."""

    def on_inner(self, surface_mm: Array) -> Array:
        """K_is u: forces (3n,) on the n inner nodes for motions (c, 3) of the surface."""

    def on_surface(self, surface_mm: Array, inner_mm: Array) -> Array:
        """K_ss u + K_si u_i: forces (c, 3) for motions (c, 3) of the surface, (3n,) inside."""

    @property
    def n_bytes(self) -> int:
        """Bytes that both products read."""


@dataclass(frozen=True, eq=False)
class AssembledCoupling:
    """By the blocks of the assembled matrix, of any pad."""

    system: PadSystem

    def on_inner(self, surface_mm: Array) -> Array:
        """See `Coupling`."""
        return np.asarray(self.system.surface_to_inner @ surface_mm.ravel())

    def on_surface(self, surface_mm: Array, inner_mm: Array) -> Array:
        """See `Coupling`."""
        own = self.system.surface @ surface_mm.ravel()
        return np.asarray(own + self.system.inner_to_surface @ inner_mm).reshape(-1, 3)

    @property
    def n_bytes(self) -> int:
        """Bytes of the blocks."""
        s = self.system
        return sum(map(matrix_bytes, (s.surface, s.surface_to_inner, s.inner_to_surface)))


@dataclass(frozen=True, eq=False)
class LayerCoupling:
    """Without a matrix, of a flat pad of several layers without cut cells and membranes."""

    system: PadSystem

    def on_inner(self, surface_mm: Array) -> Array:
        """See `Coupling`."""
        system = self.system
        force = np.zeros((system.layers - 1, system.columns, 3))
        force[-1] = self._up.force(_with_zero(surface_mm))
        return force.ravel()

    def on_surface(self, surface_mm: Array, inner_mm: Array) -> Array:
        """See `Coupling`."""
        below = inner_mm.reshape(-1, self.system.columns, 3)[-1]
        return self._down.force(np.vstack([_with_zero(below), _with_zero(surface_mm)]))

    def from_inner(self, inner_mm: Array) -> Array:
        """K_si u_i: forces (c, 3) on the surface for motions (3n,) of the n inner nodes."""
        below = inner_mm.reshape(-1, self.system.columns, 3)[-1]
        return self._below.force(_with_zero(below))

    @property
    def n_bytes(self) -> int:
        """Bytes that `on_inner` and `on_surface` read."""
        return self._up.n_bytes + self._down.n_bytes

    @cached_property
    def _up(self) -> Stencil:
        """From the surface to the layer below it."""
        return stencil(self.system, 1, ABOVE)

    @cached_property
    def _below(self) -> Stencil:
        """From the layer below the surface to the surface."""
        return stencil(self.system, 0, BELOW)

    @cached_property
    def _down(self) -> Stencil:
        """From the layer below the surface, and the surface itself, to the surface."""
        below, beside = self._below, stencil(self.system, 0, BESIDE)
        after = beside.neighbours + self.system.columns + 1
        return Stencil(
            below.types,
            np.hstack([below.neighbours, after]),
            np.concatenate([below.blocks, beside.blocks], axis=3),
        )


def coupling(system: PadSystem) -> Coupling:
    """The faster one that a pad allows."""
    plain = system.layers > 1 and not system.is_cut and not system.membranes
    return LayerCoupling(system) if plain else AssembledCoupling(system)


def stencil(system: PadSystem, depth: int, slots: slice) -> Stencil:
    """Rows of the nodes `depth` layers below the surface for those in the same 9 columns.

    Args:
        system: Equations of a pad without cut cells.
        depth: 0 for the surface.
        slots: Of `occupancy_table`: those of the layer of the neighbours.
    """
    count, end = system.columns, len(system.mesh.numbering.masks) - depth * system.columns
    kinds, types = np.unique(system.mesh.numbering.masks[end - count : end], return_inverse=True)
    table = occupancy_table(np.asarray(system.element_matrix))[kinds][:, slots]
    rows, columns = system.lattice_positions.T
    lattice = np.full(system.mesh.numbering.shape[1:], count, dtype=np.int64)
    lattice[rows, columns] = np.arange(count)
    windows = sliding_window_view(np.pad(lattice, 1, constant_values=count), (3, 3))
    blocks = np.ascontiguousarray(table.transpose(0, 2, 3, 1))
    return Stencil(types.astype(np.int64), windows[rows, columns].reshape(-1, 9), blocks)


def _with_zero(moved_mm: Array) -> Array:
    """Motions (c + 1, 3) with a last one of 0, for neighbours that are absent."""
    return np.vstack([moved_mm, np.zeros((1, 3))])
