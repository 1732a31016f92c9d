"""Evidence in the dots' sizes: how much better 'large anchor' explains a dot than 'regular'."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_force.detection.detections import Detections
from gelslim_force.lattice.growth import Lattice
from ifem_export.markers.grid import ANCHOR_LARGE, MarkerGrid

_SCATTER = 0.15
"""Standard deviation of the logarithm of a dot's area among its neighbours'."""
_MOST = 4.0
"""No one dot says more than this, for dirt and glare change sizes too: odds of 55 to 1."""


def size_evidence(
    lattice: Lattice, detections: Detections, grid: MarkerGrid
) -> NDArray[np.float64]:
    """Return log P(area | large) - log P(area | regular) for each lattice dot (k,).

    Areas are compared with the median of the 5 x 5 neighbours, so keystone drops out. All zero
    for a print without large anchors.
    """
    large = grid.kind == ANCHOR_LARGE
    if not large.any():
        return np.zeros(len(lattice.dots))
    rise = 2 * np.log(np.median(grid.diameter_mm[large]) / np.median(grid.diameter_mm[~large]))
    area = np.log(detections.area_px[lattice.dots])
    table = np.full(tuple(np.array(lattice.shape) + 4), np.nan)
    table[tuple((lattice.sites + 2).T)] = area
    windows = np.lib.stride_tricks.sliding_window_view(table, (5, 5))
    usual = np.nanmedian(windows[tuple(lattice.sites.T)].reshape(len(area), -1), axis=1)
    off = area - usual
    evidence = (off**2 - (off - rise) ** 2) / (2 * _SCATTER**2)
    clipped: NDArray[np.float64] = np.clip(evidence, -_MOST, _MOST)
    return clipped
