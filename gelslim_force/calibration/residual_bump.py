"""Regions where neighbouring dots are displaced together: contact, or a warped print.

The noise of detection and print is independent from dot to dot, but a contact moves a whole
neighbourhood. The median over a neighbourhood of k dots is robust against single outliers. Its
standard deviation is that of the noise times sqrt(pi / 2k) for large k, so that its length over
that is Rayleigh distributed if there is only noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]
_RADII_PITCHES = (1.6, 2.4)
"""Radii of the neighbourhoods: 9 and 21 dots."""
_LEAST_DOTS = 5
_LOCAL_SPREAD = 0.35
_SIGMAS = 6.0
"""The largest of the 4000 medians of 2000 dots with noise alone exceeds this in one of 10^4
pictures."""


@dataclass(frozen=True)
class ResidualBump:
    """The neighbourhood with the most significant displacement."""

    x_mm: float
    y_mm: float
    shift_mm: float
    """Length of the neighbourhood's median residual."""
    sigmas: float
    """`shift_mm` over its standard deviation if there is only noise."""
    spread: float
    """Share of all neighbourhoods displaced by more than half of it: small for a local bump."""

    @property
    def local(self) -> bool:
        """Whether the displacement is local, as of a contact, not everywhere, as of a poor fit."""
        return self.significant and self.spread <= _LOCAL_SPREAD

    @property
    def significant(self) -> bool:
        """Whether it is too large to be noise."""
        return self.sigmas > _SIGMAS


@dataclass(frozen=True)
class ResidualField:
    """Residuals split into a part that neighbours share and a part of each dot alone."""

    own_mm: float
    """Standard deviation of one dot along one axis relative to its neighbours."""
    shared_mm: float
    """Root mean square length of the neighbourhoods' medians, minus the noise."""
    bump: ResidualBump | None
    """None if there are too few neighbours."""


def split_residuals(
    positions_mm: ArrayLike, residual_mm: ArrayLike, pitch_mm: float
) -> ResidualField:
    """Split the residuals (n, 2) of dots at (n, 2), both in mm on the gel.

    Raises ValueError for other shapes.
    """
    at, off = np.asarray(positions_mm, dtype=float), np.asarray(residual_mm, dtype=float)
    if at.shape != off.shape or at.ndim != 2 or at.shape[1] != 2:
        raise ValueError(f"positions {at.shape} and residuals {off.shape}: both must be (n, 2)")
    near, count = _medians(at, off, _RADII_PITCHES[0] * pitch_mm)
    ready = np.isfinite(near).all(axis=1)
    if ready.sum() < _LEAST_DOTS:
        return ResidualField(float(np.std(off)), 0.0, None)
    others, _ = _medians(at, off, _RADII_PITCHES[0] * pitch_mm, include_self=False)
    # The other k - 1 dots' median adds pi / 2 (k - 1) of a dot's variance.
    alone = (off - others)[ready] / np.sqrt(1 + np.pi / (2 * (count[ready] - 1)))[:, None]
    own = max(1.4826 * float(np.median(np.abs(alone))), 1e-9)
    squared = (near[ready] ** 2).sum(axis=1) - np.pi * own**2 / count[ready]
    shared = float(np.sqrt(max(squared.mean(), 0.0)))
    found = [_largest(at, off, own, radius * pitch_mm) for radius in _RADII_PITCHES]
    return ResidualField(own, shared, max(found, key=lambda bump: bump.sigmas))


def _medians(
    at: Array, off: Array, radius_mm: float, include_self: bool = True
) -> tuple[Array, Array]:
    """Medians (n, 2) over all dots within the radius, and the number (n,) of these dots."""
    near = cKDTree(at).query_ball_point(at, radius_mm)
    count = np.array([len(k) for k in near], dtype=float)
    chosen = near if include_self else [[j for j in k if j != i] or k for i, k in enumerate(near)]
    medians = np.array([np.median(off[k], axis=0) for k in chosen])
    medians[count < _LEAST_DOTS] = np.nan
    return medians, count


def _largest(at: Array, off: Array, own: float, radius_mm: float) -> ResidualBump:
    medians, count = _medians(at, off, radius_mm)
    length = np.hypot(*medians.T)
    sigmas = np.where(np.isfinite(length), length / (own * np.sqrt(np.pi / (2 * count))), 0.0)
    k = int(np.argmax(sigmas))
    seen = length[np.isfinite(length)]
    return ResidualBump(
        x_mm=float(at[k, 0]),
        y_mm=float(at[k, 1]),
        shift_mm=float(length[k]),
        sigmas=float(sigmas[k]),
        spread=float((seen > length[k] / 2).mean()),
    )
