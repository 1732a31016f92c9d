"""Operators of the infinite layered pad, applied to a cropped one by FFT.

Away from its rim the pad looks the same from every column of nodes, so its stiffness is a
convolution: one Hermitian 3L x 3L block per lateral wavevector for L layers of free nodes. Padded
with zeros and restricted to the columns that exist, its inverse preconditions the cropped pad:
it is symmetric and positive definite, whatever the crop.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ifem_export.assembly.occupancy_table import occupancy_table

Array = NDArray[np.float64]
Blocks = NDArray[np.complex128]
PADDING_THICKNESSES = 1.7
LEAST_PADDING, MOST_PADDING = 4, 2.0
"""Columns at least, extents of the pad at most: beyond, a thick pad gains nothing."""
INNER_NODE, TOP_NODE = 255, 15
"""Masks of a node with all eight cells, and of one on the outer surface with the lower four."""


@dataclass(frozen=True, eq=False)
class LayeredOperator:
    """A convolution over the columns of a pad.

    `blocks` (ky, kx, 3L, 3L) act on the half spectrum of (L, 3) values per column; `columns`
    (c, 2) are the columns' lattice places (j, i) and `shape` the padded lattice.
    """

    blocks: Blocks
    columns: NDArray[np.int64]
    shape: tuple[int, int]

    def __call__(self, field: Array) -> Array:
        """Apply to a field (L, c, 3); the answer has its shape."""
        layers, count, _ = field.shape
        j, i = self.columns[:, 0], self.columns[:, 1]
        lattice = np.zeros((3 * layers, *self.shape))
        lattice[:, j, i] = field.transpose(0, 2, 1).reshape(-1, count)
        waves = fft.rfft2(lattice, workers=1)
        mixed = np.matmul(self.blocks, waves.transpose(1, 2, 0)[..., None])[..., 0]
        answer = fft.irfft2(mixed.transpose(2, 0, 1), s=self.shape, workers=1)
        return np.ascontiguousarray(answer[:, j, i].reshape(layers, 3, count).transpose(0, 2, 1))


def layered_operator(
    element_matrix: Array,
    layers: int,
    columns: NDArray[np.int64],
    padding: tuple[int, int],
    change: Callable[[Blocks], Blocks],
) -> LayeredOperator:
    """Operator whose blocks are `change` of the stiffness blocks of `layers` free layers.

    Args:
        element_matrix: (24, 24) in N/mm.
        layers: layers of free nodes, the outer surface last.
        columns: (c, 2) lattice places (j, i), from 0.
        padding: columns of zeros beyond the lattice along (y, x).
        change: from (ky, kx, 3L, 3L) blocks to the blocks wanted.
    """
    extent = columns.max(axis=0) + 1
    shape = tuple(even_fast_length(int(n + p)) for n, p in zip(extent, padding, strict=True))
    symbol = stiffness_symbol(element_matrix, layers, (shape[0], shape[1]))
    return LayeredOperator(change(symbol), columns, (shape[0], shape[1]))


def padding_columns(
    cell_size_mm: tuple[float, float, float], layers: int, extent: tuple[int, int]
) -> tuple[int, int]:
    """Columns of zeros along (y, x) that keep a pad of `extent` from meeting its own image."""
    reach = PADDING_THICKNESSES * layers * cell_size_mm[2]
    most = math.ceil(MOST_PADDING * max(extent))
    y, x = (max(LEAST_PADDING, min(most, math.ceil(reach / cell_size_mm[axis]))) for axis in (1, 0))
    return y, x


def even_fast_length(least: int) -> int:
    """Smallest even length >= `least` that transforms fast.

    The alternating motion of neighbouring nodes changes no cell's mean volume, so it is soft near
    ν = 0.5. A lattice of odd length has no such wave and takes it for a stiff one: at ν = 0.4999
    that costs 80 to 110 iterations instead of 20 to 40.
    """
    length = int(fft.next_fast_len(least, real=True))
    while length % 2:
        length = int(fft.next_fast_len(length + 1, real=True))
    return length


def stiffness_symbol(element_matrix: Array, layers: int, shape: tuple[int, int]) -> Blocks:
    """Stiffness blocks (ky, kx half, 3L, 3L) in N/mm of the infinite pad on a lattice."""
    table = occupancy_table(element_matrix)
    phase_y = np.exp(2j * np.pi * np.fft.fftfreq(shape[0]))
    phase_x = np.exp(2j * np.pi * np.fft.rfftfreq(shape[1]))
    blocks = np.zeros((shape[0], len(phase_x), layers, 3, layers, 3), dtype=complex)
    for layer in range(layers):
        mask = TOP_NODE if layer == layers - 1 else INNER_NODE
        for dz in (-1, 0, 1):
            other = layer + dz
            if not 0 <= other < layers:
                continue
            for dy in (-1, 0, 1):
                for dx in (-1, 0, 1):
                    wave = phase_y[:, None] ** dy * phase_x[None, :] ** dx
                    slot = 9 * (dz + 1) + 3 * (dy + 1) + (dx + 1)
                    part = wave[..., None, None] * table[mask, slot]
                    blocks[:, :, layer, :, other, :] += part
    return blocks.reshape(shape[0], len(phase_x), 3 * layers, 3 * layers)


def inverse(blocks: Blocks) -> Blocks:
    """Compliance blocks, Hermitian to rounding."""
    found = np.linalg.inv(blocks)
    return np.asarray((found + found.conj().swapaxes(-1, -2)) / 2)


def surface_stiffness(blocks: Blocks) -> Blocks:
    """Blocks (ky, kx, 3, 3) of the surface alone: S = K_ss - K_si K_ii⁻¹ K_is."""
    inner, top = blocks[..., :-3, :-3], blocks[..., -3:, -3:]
    if inner.shape[-1] == 0:
        return top
    across = blocks[..., :-3, -3:]
    return np.asarray(top - across.conj().swapaxes(-1, -2) @ np.linalg.solve(inner, across))


def surface_compliance(blocks: Blocks) -> Blocks:
    """Blocks (ky, kx, 3, 3) of surface displacement per surface force."""
    return inverse(surface_stiffness(blocks))


def inner_compliance(blocks: Blocks) -> Blocks:
    """Compliance blocks of the inner layers with the surface held."""
    return inverse(blocks[..., :-3, :-3])
