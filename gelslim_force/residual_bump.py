"""Places where neighbouring dots are off together: contact in the reference, or a warped print.

Noise of detection and print differs from dot to dot; a press moves a whole neighbourhood. The
mean over a neighbourhood of k dots has the noise's standard deviation over sqrt(k), so its
length over that is Rayleigh distributed where there is noise alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]
_REACHES = (1.6, 2.4)
"""Radii of neighbourhoods in pitches: 9 and 21 dots."""
_LEAST_DOTS = 5
_SIGMAS = 6.0
"""Among 2000 dots of pure noise the largest of 4000 means passes this once in 10^4 pictures."""


@dataclass(frozen=True)
class ResidualBump:
    """The neighbourhood that stands out most."""

    x_mm: float
    y_mm: float
    shift_mm: float
    """Length of the neighbourhood's mean residual."""
    sigmas: float
    """The same over its standard deviation under noise."""
    spread: float
    """Share of all neighbourhoods off by more than half of it: small for a local bump."""

    @property
    def significant(self) -> bool:
        """Whether noise alone does not explain it."""
        return self.sigmas > _SIGMAS


@dataclass(frozen=True)
class ResidualField:
    """Residuals split into what neighbours share and what is each dot's own."""

    own_mm: float
    """Standard deviation of one dot along one axis against its neighbours."""
    shared_mm: float
    """Root mean square length of the neighbourhoods' means, noise taken off."""
    bump: ResidualBump | None
    """None with too few neighbours."""


def split_residuals(
    positions_mm: ArrayLike, residual_mm: ArrayLike, pitch_mm: float
) -> ResidualField:
    """Split the residuals (n, 2) of dots at (n, 2), both in mm on the gel.

    Raises ValueError for shapes that do not fit.
    """
    at, off = np.asarray(positions_mm, dtype=float), np.asarray(residual_mm, dtype=float)
    if at.shape != off.shape or at.ndim != 2 or at.shape[1] != 2:
        raise ValueError(f"positions {at.shape} and residuals {off.shape}: both must be (n, 2)")
    near, count = _means(at, off, _REACHES[0] * pitch_mm)
    ready = np.isfinite(near).all(axis=1)
    if ready.sum() < _LEAST_DOTS:
        return ResidualField(float(np.std(off)), 0.0, None)
    # A dot is part of its own neighbourhood's mean: the difference's variance is (k - 1) / k.
    alone = (off - near)[ready] * np.sqrt(count / (count - 1))[ready, None]
    own = max(1.4826 * float(np.median(np.abs(alone))), 1e-9)
    squared = (near[ready] ** 2).sum(axis=1) - 2 * own**2 / count[ready]
    shared = float(np.sqrt(max(squared.mean(), 0.0)))
    found = [_largest(at, off, own, reach * pitch_mm) for reach in _REACHES]
    return ResidualField(own, shared, max(found, key=lambda bump: bump.sigmas))


def _means(at: Array, off: Array, reach_mm: float) -> tuple[Array, Array]:
    """Means (n, 2) over all dots within reach, and how many (n,) they are."""
    near = cKDTree(at).query_ball_point(at, reach_mm)
    count = np.array([len(k) for k in near], dtype=float)
    means = np.array([off[k].mean(axis=0) for k in near])
    means[count < _LEAST_DOTS] = np.nan
    return means, count


def _largest(at: Array, off: Array, own: float, reach_mm: float) -> ResidualBump:
    means, count = _means(at, off, reach_mm)
    length = np.hypot(*means.T)
    sigmas = np.where(np.isfinite(length), length * np.sqrt(count) / own, 0.0)
    k = int(np.argmax(sigmas))
    seen = length[np.isfinite(length)]
    return ResidualBump(
        x_mm=float(at[k, 0]),
        y_mm=float(at[k, 1]),
        shift_mm=float(length[k]),
        sigmas=float(sigmas[k]),
        spread=float((seen > length[k] / 2).mean()),
    )
