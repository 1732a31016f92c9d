"""A symmetric matrix of a pad, stored or known by its products only."""

from __future__ import annotations

from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]


class UnstoredMatrix(Protocol):
    """A symmetric matrix that is known by its products."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of rows and of columns."""

    def __matmul__(self, x: Array) -> Array:
        """Its product with a vector."""

    def tocsr(self) -> sparse.csr_array:
        """The matrix itself, to be factored."""

    @property
    def n_bytes(self) -> int:
        """Bytes that a product reads and writes."""


Matrix: TypeAlias = sparse.csr_array | UnstoredMatrix


def matrix_bytes(matrix: Matrix) -> int:
    """Bytes that a product reads; of a stored matrix those of its values and their places."""
    if isinstance(matrix, sparse.csr_array):
        return int(matrix.data.nbytes + matrix.indices.nbytes + matrix.indptr.nbytes)
    return matrix.n_bytes
