"""Dense Cholesky factor of a pad's stiffness, row of columns by row of columns.

Nodes couple only with the next rows of the lattice, so that the stiffness is block tridiagonal.
Dense blocks keep many right-hand sides in matrix products, where a sparse factor's
back-substitution is ten times slower; a pad of 43 x 43 x 4 cells takes 200 MB.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import LinAlgError, cholesky, solve_triangular

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class RowFactor:
    """L of K = L Lᵀ by blocks; `rows` holds the unknowns of each block."""

    rows: tuple[Indices, ...]
    diagonal: tuple[Array, ...]
    below: tuple[Array, ...]

    @classmethod
    def of(cls, matrix: sparse.csr_array, row: NDArray[np.integer]) -> RowFactor:
        """Factor a symmetric matrix (n, n) whose unknowns lie in lattice rows `row` (n,).

        Raises LinAlgError where it is not positive definite, ValueError where rows couple that
        are not neighbours.
        """
        order = np.argsort(row, kind="stable")
        ends = np.cumsum(np.unique(row, return_counts=True)[1])[:-1]
        rows = tuple(np.split(order, ends))
        sorted_matrix = sparse.csr_array(matrix[order][:, order])
        starts = np.concatenate([[0], ends, [len(order)]])
        diagonal: list[Array] = []
        below: list[Array] = []
        covered = 0
        for k in range(len(rows)):
            here = slice(starts[k], starts[k + 1])
            strip = sorted_matrix[here]
            block = strip[:, here].toarray()
            covered += strip[:, here].nnz
            if k > 0:
                left = strip[:, starts[k - 1] : starts[k]]
                covered += 2 * left.nnz
                low = solve_triangular(
                    diagonal[-1], left.toarray().T, lower=True, check_finite=False
                ).T
                block -= low @ low.T
                below.append(low)
            diagonal.append(cholesky(block, lower=True, overwrite_a=True, check_finite=False))
        if covered != sorted_matrix.nnz:
            raise ValueError("rows that are not neighbours are coupled")
        return cls(rows, tuple(diagonal), tuple(below))

    @property
    def size(self) -> int:
        """Unknowns n."""
        return sum(len(r) for r in self.rows)

    def solve(self, loads: Array) -> Array:
        """K⁻¹ b for b (n,) or (n, k)."""
        found = np.empty_like(loads, dtype=float)
        half = list(self._forward(loads))
        later: Array | None = None
        for k in reversed(range(len(self.rows))):
            right = half[k] if later is None else half[k] - self.below[k].T @ later
            later = _triangular(self.diagonal[k], right, transposed=True)
            found[self.rows[k]] = later
        return found

    def compliance(self, unknowns: Indices) -> Array:
        """(K⁻¹) among some unknowns (m,), as (m, m): Yᵀ Y with Y = L⁻¹ E."""
        m = len(unknowns)
        place = np.full(self.size, -1, dtype=np.intp)
        place[unknowns] = np.arange(m)
        total, last = np.zeros((m, m)), None
        for k, row in enumerate(self.rows):
            right = np.zeros((len(row), m)) if last is None else -(self.below[k - 1] @ last)
            own = place[row]
            right[np.flatnonzero(own >= 0), own[own >= 0]] += 1.0
            if last is None and not (own >= 0).any():
                continue
            last = _triangular(self.diagonal[k], right)
            total += last.T @ last
        return total

    def _forward(self, loads: Array) -> Iterator[Array]:
        last: Array | None = None
        for k, row in enumerate(self.rows):
            right = loads[row] if last is None else loads[row] - self.below[k - 1] @ last
            last = _triangular(self.diagonal[k], right)
            yield last


def _triangular(lower: Array, right: Array, transposed: bool = False) -> Array:
    return np.asarray(
        solve_triangular(lower, right, lower=True, trans=1 if transposed else 0, check_finite=False)
    )


__all__ = ["LinAlgError", "RowFactor"]
