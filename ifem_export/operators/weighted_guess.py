"""The infinite pad's operators as preconditioners of pads that are partly filled or crowned."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ifem_export.operators.layered_operator import Blocks, LayeredOperator

Array = NDArray[np.float64]


class Guess(Protocol):
    """An approximate inverse of fields (L, n, 3)."""

    @property
    def blocks(self) -> Blocks:
        """What it keeps."""

    def __call__(self, field: Array) -> Array:
        """Apply."""


@dataclass(frozen=True, eq=False)
class WeightedGuess:
    """D^-1/2 G D^-1/2: a node whose cells are filled to a share D is that much softer.

    `guess` takes (L, c, 3) fields; `weight` (L, c) is D^-1/2.
    """

    guess: LayeredOperator
    weight: Array

    @property
    def blocks(self) -> Blocks:
        """Those of the uniform pad."""
        return self.guess.blocks

    def __call__(self, field: Array) -> Array:
        """Apply to a field (L, c, 3)."""
        weight = self.weight[..., None]
        return np.asarray(weight * self.guess(weight * field))


@dataclass(frozen=True, eq=False)
class EmbeddedGuess:
    """The same for unknowns that are some of the nodes of a full lattice.

    Args:
        guess: operator of the full pad of `layers` layers over its columns.
        layers: layers of free nodes of the full pad.
        columns: its columns.
        layer, column: (n,) place of each unknown node there.
        weight: (n,) D^-1/2.
        change: (n, n), unknowns = change @ node values; None where they are the same.
    """

    guess: LayeredOperator
    layers: int
    columns: int
    layer: NDArray[np.int64]
    column: NDArray[np.int64]
    weight: Array
    change: sparse.csr_array | None = None

    @property
    def blocks(self) -> Blocks:
        """Those of the uniform pad."""
        return self.guess.blocks

    def __call__(self, field: Array) -> Array:
        """Apply to a field (1, n, 3)."""
        r = field[0] if self.change is None else self.change.T @ field[0]
        lattice = np.zeros((self.layers, self.columns, 3))
        lattice[self.layer, self.column] = self.weight[:, None] * r
        u = self.weight[:, None] * self.guess(lattice)[self.layer, self.column]
        return np.asarray(u if self.change is None else self.change @ u)[None]
