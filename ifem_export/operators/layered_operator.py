"""Operators of the laterally infinite pad, applied to a cropped pad by FFT.

Far from the rim all columns of nodes see the same neighbourhood, so the stiffness is a
convolution: one Hermitian 3L x 3L block per lateral wave vector for L layers of free nodes. Its
inverse, padded with zeros and restricted to the existing columns, is symmetric and positive
definite for every crop, and preconditions the equations of the cropped pad: `preconditioner`
applies it in less time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ifem_export.assembly.occupancy_table import occupancy_table

Array = NDArray[np.float64]
Blocks = NDArray[np.complex128]
AnyBlocks = TypeVar("AnyBlocks", NDArray[np.complex128], NDArray[np.float64])
"""Hermitian blocks; where the pad is its own mirror image they can be real (`preconditioner`)."""
PADDING_THICKNESSES = 1.7
LEAST_PADDING, MOST_PADDING = 4, 2.0
"""Bounds of the padding: at least in columns, at most in extents of the pad."""
INNER_NODE, TOP_NODE = 255, 15
"""Masks of a node with all eight cells, and of one on the outer surface with the lower four."""


@dataclass(frozen=True, eq=False)
class LayeredOperator:
    """A convolution over the columns of a pad.

    Attributes:
        blocks: (ky, kx, 3L, 3L), which act on the half spectrum of (L, 3) values per column.
        columns: (c, 2) lattice positions (j, i) of the columns.
        shape: Size (rows, columns) of the padded lattice.
    """

    blocks: Blocks
    columns: NDArray[np.int64]
    shape: tuple[int, int]

    def __call__(self, field: Array) -> Array:
        """Apply to a field (L, c, 3); the result has the same shape."""
        layers, count, _ = field.shape
        j, i = self.columns[:, 0], self.columns[:, 1]
        lattice = np.zeros((3 * layers, *self.shape))
        lattice[:, j, i] = field.transpose(0, 2, 1).reshape(-1, count)
        waves = fft.rfft2(lattice, workers=1)
        mixed = np.matmul(self.blocks, waves.transpose(1, 2, 0)[..., None])[..., 0]
        result = fft.irfft2(mixed.transpose(2, 0, 1), s=self.shape, workers=1)
        return np.ascontiguousarray(result[:, j, i].reshape(layers, 3, count).transpose(0, 2, 1))


def layered_operator(
    element_matrix: Array,
    layers: int,
    columns: NDArray[np.int64],
    padding: tuple[int, int],
    transform: Callable[[Blocks], Blocks],
) -> LayeredOperator:
    """Operator whose blocks follow from the stiffness blocks of `layers` free layers.

    Args:
        element_matrix: (24, 24) in N/mm.
        layers: Layers of free nodes, the outer surface last.
        columns: (c, 2) lattice positions (j, i), from 0.
        padding: Columns of zeros beyond the lattice along (y, x).
        transform: Function from the (ky, kx, 3L, 3L) stiffness blocks to the operator's blocks.
    """
    extent = columns.max(axis=0) + 1
    shape = tuple(even_fast_length(int(n + p)) for n, p in zip(extent, padding, strict=True))
    symbol = stiffness_symbol(element_matrix, layers, (shape[0], shape[1]))
    return LayeredOperator(transform(symbol), columns, (shape[0], shape[1]))


def padding_columns(
    cell_size_mm: tuple[float, float, float], layers: int, extent: tuple[int, int]
) -> tuple[int, int]:
    """Columns of zeros along (y, x) that separate a pad of `extent` from its periodic image."""
    reach = PADDING_THICKNESSES * layers * cell_size_mm[2]
    most = math.ceil(MOST_PADDING * max(extent))
    y, x = (max(LEAST_PADDING, min(most, math.ceil(reach / cell_size_mm[axis]))) for axis in (1, 0))
    return y, x


def even_fast_length(least: int) -> int:
    """Smallest even length >= `least` with a fast Fourier transform.

    An alternating displacement of neighbouring nodes does not change the mean volume of any cell,
    so it is soft near ν = 0.5. A lattice of odd length cannot represent this wave and treats it as
    stiff: at ν = 0.4999 this takes 80 to 110 iterations instead of 20 to 40.
    """
    length = int(fft.next_fast_len(least, real=True))
    while length % 2:
        length = int(fft.next_fast_len(length + 1, real=True))
    return length


def stiffness_symbol(
    element_matrix: Array, layers: int, shape: tuple[int, int], rows: int | None = None
) -> Blocks:
    """Stiffness blocks (ky, kx half, 3L, 3L) in N/mm of the infinite pad on a lattice.

    Of the wave numbers ky only the first `rows` are taken, all of them by default.
    """
    table = occupancy_table(element_matrix)
    phase_y = np.exp(2j * np.pi * np.fft.fftfreq(shape[0])[:rows])
    phase_x = np.exp(2j * np.pi * np.fft.rfftfreq(shape[1]))
    blocks = np.zeros((len(phase_y), len(phase_x), layers, 3, layers, 3), dtype=complex)
    for mask in (INNER_NODE, TOP_NODE):
        of_mask = range(layers - 1) if mask == INNER_NODE else [layers - 1]
        for dz in (-1, 0, 1):
            pairs = [(layer, layer + dz) for layer in of_mask if 0 <= layer + dz < layers]
            if not pairs:
                continue
            part = np.zeros((len(phase_y), len(phase_x), 3, 3), dtype=complex)
            for dy in (-1, 0, 1):
                for dx in (-1, 0, 1):
                    wave = phase_y[:, None] ** dy * phase_x[None, :] ** dx
                    part += (
                        wave[..., None, None] * table[mask, 9 * (dz + 1) + 3 * (dy + 1) + dx + 1]
                    )
            for layer, other in pairs:
                blocks[:, :, layer, :, other, :] = part
    return blocks.reshape(len(phase_y), len(phase_x), 3 * layers, 3 * layers)


def inverse(blocks: AnyBlocks) -> AnyBlocks:
    """Compliance blocks, Hermitian to rounding."""
    found: Any = np.linalg.inv(blocks)
    return np.asarray((found + found.conj().swapaxes(-1, -2)) / 2)


def surface_stiffness(blocks: AnyBlocks) -> AnyBlocks:
    """Blocks (ky, kx, 3, 3) of the surface alone: S = K_ss - K_si K_ii⁻¹ K_is."""
    whole: Any = blocks
    inner, top = whole[..., :-3, :-3], whole[..., -3:, -3:]
    if inner.shape[-1] == 0:
        return np.asarray(top)
    coupling = whole[..., :-3, -3:]
    return np.asarray(top - coupling.conj().swapaxes(-1, -2) @ np.linalg.solve(inner, coupling))


def surface_compliance(blocks: AnyBlocks) -> AnyBlocks:
    """Blocks (ky, kx, 3, 3) of surface displacement per surface force."""
    return inverse(surface_stiffness(blocks))


def inner_compliance(blocks: AnyBlocks) -> AnyBlocks:
    """Compliance blocks of the inner layers with the surface fixed."""
    return inverse(blocks[..., :-3, :-3])
