"""Normal compliance of the pad's surface, computed column by column and kept.

A column holds the normal displacement of all c surface nodes under 1 N on one of them. On a pad
with mirror symmetries one column of each set of equivalent nodes is enough: an eighth of them on a
square pad. Columns are computed when first needed, in batches.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.linalg import SuperLU

from gelslim_force.layer.beyond_mesh import NearMotion
from ifem_export.compliance.contact_columns import ContactCompliance
from ifem_export.operators.condensed_operators import (
    CondensedOperator,
    DenseOperator,
    PaperOperator,
)
from ifem_export.operators.solver import factored

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
BATCH = 32
REVERSALS: tuple[tuple[int, ...], ...] = ((), (0,), (1,), (0, 1))
"""Axes to reverse, for each reflection."""


class Compliant(Protocol):
    """The part of a surface operator that is needed here."""

    def displacement(self, force_n: ArrayLike) -> Array:
        """Displacement (c, 3) in mm under forces (c, 3) in N."""


class NormalCompliance:
    """C_zz of a surface operator: float32 columns in mm/N.

    They come from `displacement`. Near the edge of the pad, where a fast operator takes it for a
    periodic layer, they come from `edge`, if that is given. For an operator that holds the full
    system of the pad, they come from one factorisation with many right-hand sides: the same
    numbers, several times faster. What the mesh leaves out near a force is added by `beyond`: it,
    and the places (c, 2) of the nodes.
    """

    def __init__(
        self,
        operator: Compliant,
        columns: int,
        edge: ContactCompliance | None = None,
        beyond: tuple[NearMotion, Array] | None = None,
    ) -> None:
        self._operator, self._edge, self._beyond = operator, edge, beyond
        self._columns = columns
        self._values = np.zeros((columns, columns), dtype=np.float32)
        self._known = np.zeros(columns, dtype=bool)
        self._factor: SuperLU | None = None
        self._permutations = _symmetries(operator, columns)
        """(g, c) permutations of the nodes that leave the pad unchanged, the identity first."""
        self._original: Nodes = self._permutations.min(axis=0)
        self._symmetry: Nodes = self._permutations.argmin(axis=0)

    @property
    def ready(self) -> float:
        """Share of the columns that are computed."""
        return float(self._known.mean())

    def prepare(self) -> None:
        """Compute all columns now."""
        self._compute(np.arange(self._columns))

    def block(self, nodes: Nodes) -> Array:
        """C_zz (n, n) among `nodes` (n,), symmetric."""
        self._compute(nodes)
        block = self._values[np.ix_(nodes, nodes)].astype(float)
        return np.asarray((block + block.T) / 2)

    def apply(self, nodes: Nodes, force_n: Array) -> Array:
        """Normal displacement (c,) or (c, k) in mm under forces (n,) or (n, k) on `nodes`."""
        self._compute(nodes)
        # Rows may be used as columns: the compliance is symmetric.
        return np.asarray(self._values[nodes].T @ force_n.astype(np.float32), dtype=float)

    def _compute(self, nodes: Nodes) -> None:
        if self._known[nodes].all():
            return
        missing = np.asarray(nodes)[~self._known[nodes]]
        originals = np.unique(self._original[missing])
        originals = originals[~self._known[originals]]
        for first in range(0, len(originals), BATCH):
            part = originals[first : first + BATCH]
            self._values[part] = self._solved(part).T
            self._known[part] = True
        for node in missing[~self._known[missing]]:
            permutation = self._permutations[self._symmetry[node]]
            self._values[node] = self._values[self._original[node], permutation]
            self._known[node] = True

    def _solved(self, nodes: Nodes) -> Array:
        """Columns (c, n)."""
        columns = self._of_mesh(nodes)
        if self._beyond is not None:
            near, points = self._beyond
            away = points[:, None] - points[nodes]
            row, column = np.nonzero((np.abs(away) < near.reach_mm).all(axis=2))
            columns[row, column] += near.at(away[row, column])[:, 2, 2]
        return columns

    def _of_mesh(self, nodes: Nodes) -> Array:
        """Columns (c, n) of the mesh."""
        if self._edge is None:
            return self._fast(nodes)
        near = self._edge.ahead[nodes]
        columns = np.empty((self._columns, len(nodes)))
        columns[:, near] = self._edge.compliance.columns(nodes[near])[:, 2, :, 2].T
        columns[:, ~near] = self._fast(nodes[~near])
        return columns

    def _fast(self, nodes: Nodes) -> Array:
        """Columns (c, n) by the operator."""
        if len(nodes) == 0:
            return np.empty((self._columns, 0))
        if not isinstance(self._operator, (PaperOperator, CondensedOperator, DenseOperator)):
            return np.column_stack([self._one(node) for node in nodes])
        system = self._operator.system
        if self._factor is None:
            self._factor = factored(system.stiffness)
        unknowns = system.stiffness.shape[0]
        loads = np.zeros((unknowns, len(nodes)))
        loads[unknowns - 3 * self._columns + 3 * nodes + 2, np.arange(len(nodes))] = 1.0
        moved = self._factor.solve(loads)
        return np.asarray(moved[unknowns - 3 * self._columns :][2::3])

    def _one(self, node: int) -> Array:
        force = np.zeros((self._columns, 3))
        force[node, 2] = 1.0
        return np.asarray(self._operator.displacement(force)[:, 2])


def _symmetries(operator: Compliant, columns: int) -> Nodes:
    """Node permutations of the reflections and quarter rotations that leave the pad unchanged."""
    identity = np.arange(columns)
    system = getattr(operator, "system", None)
    if system is None:
        return identity[None]
    cells = np.asarray(system.mesh.occupancy)[:, :, 0].T
    rows, across = np.asarray(system.lattice_positions).T
    numbers = np.full((cells.shape[0] + 1, cells.shape[1] + 1), -1)
    numbers[rows, across] = identity
    pitch_x, pitch_y, _ = system.mesh.cell_size_mm
    square = abs(pitch_x - pitch_y) <= 1e-12 * pitch_x
    found = []
    for transposed in (False, True) if square else (False,):
        for flips in REVERSALS:
            image = np.flip(cells.T if transposed else cells, flips)
            if image.shape == cells.shape and (image == cells).all():
                moved = np.flip(numbers.T if transposed else numbers, flips)
                found.append(moved[rows, across])
    return np.array(found)
