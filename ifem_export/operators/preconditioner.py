"""Preconditioners of a pad's equations: the inverse of the infinite pad, restricted to its nodes.

Cells are bricks of an isotropic gel, so the infinite pad is its own mirror image along x and along
y. With X = diag(-1, 1, 1) and Y = diag(1, -1, 1) at every node its blocks B(ky, kx) obey

    B(ky, -kx) = X B X,   B(-ky, kx) = Y B Y,   B(-ky, -kx) = conj(B),

the last because the stiffness is real. Therefore P* B P with P = diag(1, 1, i) is real, and the
blocks of ky >= 0 hold all others. Real blocks of half the wave vectors take a quarter of the
memory, and an eighth of the time to invert.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import fft, sparse

from ifem_export.errors import IfemError
from ifem_export.mesh.lattice import VTK_CORNERS
from ifem_export.operators.layered_operator import even_fast_length, stiffness_symbol

Array = NDArray[np.float64]
MIRRORED = 1e-9
"""Largest difference of an element from its mirror image over its largest entry: rounding."""
MOST_BY_MATRICES = 64
"""Places along a lattice up to which products with matrices take less time than transforms."""
_TOGETHER = 4  # wave numbers, as many as a vector unit takes


class Preconditioner(Protocol):
    """An approximate inverse that acts on fields (L, n, 3)."""

    @property
    def blocks(self) -> Array:
        """The spectral blocks that it stores."""

    def __call__(self, field: Array) -> Array:
        """Apply to a field."""


@dataclass(frozen=True, eq=False)
class MirroredOperator:
    """A convolution over the columns of a pad that is its own mirror image along x and along y.

    Attributes:
        blocks: (ky >= 0, kx >= 0, 3L, 3L), real: P* B P.
        columns: (c, 2) lattice positions (j, i) of the columns.
        shape: Size (rows, columns) of the padded lattice, both even.
    """

    blocks: Array
    columns: NDArray[np.int64]
    shape: tuple[int, int]

    def __call__(self, field: Array) -> Array:
        """Apply to a field (L, c, 3); the result has the same shape."""
        if max(self.shape) > MOST_BY_MATRICES:
            return self.by_transforms(field)
        from ifem_export.operators.wave_kernel import convolve

        found = np.empty(field.shape)
        convolve(np.ascontiguousarray(field, dtype=float), self.columns, *self._matrices, found)
        return found

    def by_transforms(self, field: Array) -> Array:
        """The same by fast Fourier transforms, for a lattice of any size."""
        from ifem_export.operators.mirrored_kernel import collect, multiply, spread

        lattice = np.empty((*self.shape, field.shape[0], 3))
        spread(np.ascontiguousarray(field), self.columns, lattice)
        waves = fft.rfft2(lattice, axes=(0, 1), workers=1)
        multiply(self.blocks, waves.reshape(*waves.shape[:2], -1))
        result = fft.irfft2(waves, s=self.shape, axes=(0, 1), workers=1)
        found = np.empty(field.shape)
        collect(result, self.columns, found)
        return found

    @cached_property
    def _matrices(self) -> tuple[Array, Array, Array, Array, Array]:
        """Both pairs of matrices, and the blocks, as `wave_kernel.convolve` takes them."""
        used = self.columns.max(axis=0) + 1
        to_y, from_y = _cosines_and_sines(self.shape[0], int(used[0]), 1)
        to_x, from_x = _cosines_and_sines(self.shape[1], int(used[1]), _TOGETHER)
        blocks = np.zeros((*self.blocks.shape[:1], *self.blocks.shape[2:], len(to_x) // 2))
        blocks[..., : self.blocks.shape[1]] = self.blocks.transpose(0, 2, 3, 1)
        return to_y, np.ascontiguousarray(to_x.T), from_x, np.ascontiguousarray(from_y.T), blocks


def _cosines_and_sines(length: int, used: int, together: int) -> tuple[Array, Array]:
    """Matrices (2h, used) of the waves of a periodic lattice, and of their shares in a field.

    Args:
        length: Places of the lattice, an even number.
        used: Places that have values.
        together: h is a multiple of this; what is more than the waves is zero.
    """
    number = np.arange(length // 2 + 1)
    angle = 2 * np.pi * np.outer(number, np.arange(used)) / length
    waves = np.zeros((2, -(-len(number) // together) * together, used))
    waves[:, : len(number)] = np.cos(angle), np.sin(angle)
    # All but the mean and the alternating wave stand for two.
    share = np.where(number % (length // 2) == 0, 1.0, 2.0) / length
    back = waves.copy()
    back[:, : len(number)] *= share[:, None]
    return waves.reshape(-1, used), back.reshape(-1, used)


def mirrored_operator(
    element_matrix: Array,
    layers: int,
    columns: NDArray[np.int64],
    padding: tuple[int, int],
    transform: Callable[[Array], Array],
) -> MirroredOperator:
    """Operator whose blocks follow from the stiffness blocks of `layers` free layers.

    Args:
        element_matrix: (24, 24) in N/mm, of a brick of isotropic material.
        layers: Layers of free nodes, the outer surface last.
        columns: (c, 2) lattice positions (j, i), from 0.
        padding: Columns of zeros beyond the lattice along (y, x).
        transform: Function from the real blocks of the stiffness to those of the operator, which
            commutes with the change to P* B P, as `inverse` and `inner_compliance` do.

    Returns:
        The operator.

    Raises:
        IfemError: The element is not its own mirror image.
    """
    _require_mirrored(element_matrix)
    extent = columns.max(axis=0) + 1
    rows, across = (even_fast_length(int(n + p)) for n, p in zip(extent, padding, strict=True))
    symbol = stiffness_symbol(element_matrix, layers, (rows, across), rows // 2 + 1)
    by_axis = symbol.reshape(*symbol.shape[:2], layers, 3, layers, 3)
    by_axis[..., 2, :, :] *= -1j
    by_axis[..., 2] *= 1j
    return MirroredOperator(transform(np.ascontiguousarray(symbol.real)), columns, (rows, across))


def _require_mirrored(element_matrix: Array) -> None:
    """Raise IfemError for an element that is not its own mirror image along x and along y."""
    by_corner = element_matrix.reshape(8, 3, 8, 3)
    number = {tuple(corner): k for k, corner in enumerate(VTK_CORNERS.tolist())}
    for axis in (0, 1):
        mirrored = VTK_CORNERS.copy()
        mirrored[:, axis] = 1 - mirrored[:, axis]
        order = [number[tuple(corner)] for corner in mirrored.tolist()]
        sign = np.where(np.arange(3) == axis, -1.0, 1.0)
        image = by_corner[order][:, :, order] * sign[:, None, None] * sign
        if np.abs(image - by_corner).max() > MIRRORED * np.abs(by_corner).max():
            raise IfemError(
                f"the element is not its own mirror image along {'xy'[axis]}: the preconditioner "
                "is made for bricks of isotropic material",
                field="element_matrix",
            )


@dataclass(frozen=True, eq=False)
class ScaledPreconditioner:
    """D^-1/2 G D^-1/2 for a pad with cut cells, where D is the filled fraction around a node.

    Attributes:
        uniform: Preconditioner G of the pad without cut cells, for (L, c, 3) fields.
        weight: (L, c) D^-1/2.
    """

    uniform: MirroredOperator
    weight: Array

    @property
    def blocks(self) -> Array:
        """Those of the uniform pad."""
        return self.uniform.blocks

    def __call__(self, field: Array) -> Array:
        """Apply to a field (L, c, 3)."""
        weight = self.weight[..., None]
        return np.asarray(weight * self.uniform(weight * field))


@dataclass(frozen=True, eq=False)
class EmbeddedPreconditioner:
    """The same where the unknowns are only some of the nodes of a full lattice (crowned pads).

    Attributes:
        uniform: Preconditioner of the full pad of `layers` layers over its columns.
        layers: Layers of free nodes of the full pad.
        columns: Its columns.
        layer: (n,) layer of each unknown node there.
        column: (n,) column of each unknown node there.
        weight: (n,) D^-1/2.
        transformation: (n, n), unknowns = transformation @ node values; None for the identity.
    """

    uniform: MirroredOperator
    layers: int
    columns: int
    layer: NDArray[np.int64]
    column: NDArray[np.int64]
    weight: Array
    transformation: sparse.csr_array | None = None

    @property
    def blocks(self) -> Array:
        """Those of the uniform pad."""
        return self.uniform.blocks

    def __call__(self, field: Array) -> Array:
        """Apply to a field (1, n, 3)."""
        t = self.transformation
        r = field[0] if t is None else t.T @ field[0]
        lattice = np.zeros((self.layers, self.columns, 3))
        lattice[self.layer, self.column] = self.weight[:, None] * r
        u = self.weight[:, None] * self.uniform(lattice)[self.layer, self.column]
        return np.asarray(u if t is None else t @ u)[None]
