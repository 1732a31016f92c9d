"""How far the errors of the light reach: those that neighbouring bins have in common.

The noise of a sensor is independent from bin to bin. Compression rounds the light of whole blocks
of 8 or 16 pixels: many bins then err to the same side, and a mean over them errs as much as one
bin. If the reference was compressed as well, most blocks are rounded as they were there and seem to
be exact, until a few of them go to the next step.

The size of such errors is measured in each frame, where nothing touches the gel, by blocks as large
as the largest of JPEG. A contact is in a part of the picture only; errors are everywhere, so the
less restless tiles of the picture show them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Layers = NDArray[np.floating]
Mask = NDArray[np.bool_]
_BLOCK_PX, _LEAST_BINS = 16, 4
"""Side of a block of JPEG whose colours are stored at half the resolution, and bins along the side
of a block at least."""
_TILE = 4
_LEAST_VALID = 0.5
_LEAST_TILES = 8
_QUIET, _INDEPENDENT, _BY_CHANCE = 0.4, 0.84, 0.5
"""Share of the tiles that nothing touches, the size at this quantile where errors are independent,
and the excess of its square, relative to that, which is no sign of others: 70 tiles show as much by
chance, or where a deep contact changes the light of most of the pad."""
_QUIETEST, _APART, _COMPRESSED, _EXACT, _ROWS = 0.15, 1.65, 2.0, 1e-3, 8
"""A wide contact leaves fewer tiles alone. Sizes at this quantile and at the one above are a factor
of 1.64 apart at most where pictures are compressed, and up to 40 where an object covers most of the
gel. The factor tells nothing where even the quietest tiles have errors of the third size, or where
bins have less noise than the fourth, in one of so many rows: compression of both pictures then
leaves most blocks exact."""


def noise_grain(change: Layers, noise: Layers, valid: Mask, bin_px: int) -> Array:
    """(c,) factors by which the noise of bins must be larger, so that means over many bins hold.

    A factor is 1 where errors are independent, and √n at most where n bins share each error and
    `noise` is its standard deviation; it is larger where most bins seem to be exact.

    Args:
        change: (c, rows, columns) of the light, about its baseline.
        noise: (c, rows, columns) standard deviations of single bins.
        valid: (rows, columns) bins to use.
        bin_px: Pixels along the side of a bin.
    """
    from gelslim_force.contact.grain_kernel import block_sizes

    block = max(_LEAST_BINS, -(-_BLOCK_PX // bin_px))
    tiles = (valid.shape[0] // (block * _TILE)) * (valid.shape[1] // (block * _TILE))
    sizes = np.empty((len(change), max(tiles, 1)))
    count = block_sizes(change, noise, valid, block, _TILE, _LEAST_VALID, sizes)
    if count < _LEAST_TILES:
        return np.ones(len(change))
    at = [int(share * count) for share in (_QUIETEST, _QUIET)]
    quietest, usual = np.partition(sizes[:, :count], at, axis=1)[:, at].T
    some = np.median(noise[:, ::_ROWS][:, valid[::_ROWS]], axis=1)
    untold = (quietest > _COMPRESSED) | (some < _EXACT)
    most = np.where(untold, np.inf, _APART * np.maximum(quietest, _INDEPENDENT))
    usual = np.minimum(usual, most)
    return np.sqrt(np.maximum(np.square(usual / _INDEPENDENT) - _BY_CHANCE, 1.0))
