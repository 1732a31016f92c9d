"""Places where neighbouring dots are off together: contact in the reference, or a warped print.

Noise of detection and print differs from dot to dot; a press moves a whole neighbourhood. The
median over a neighbourhood of k dots, which a single stray one does not move, has the noise's
standard deviation times sqrt(pi / 2k) (large k), so its length over that is Rayleigh distributed
where there is noise alone.
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
_LOCAL_SPREAD = 0.35
_SIGMAS = 6.0
"""Among 2000 dots of pure noise the largest of 4000 medians passes this once in 10^4 pictures."""


@dataclass(frozen=True)
class ResidualBump:
    """The neighbourhood that stands out most."""

    x_mm: float
    y_mm: float
    shift_mm: float
    """Length of the neighbourhood's median residual."""
    sigmas: float
    """The same over its standard deviation under noise."""
    spread: float
    """Share of all neighbourhoods off by more than half of it: small for a local bump."""

    @property
    def local(self) -> bool:
        """Whether it stands out against the rest, as a contact does and a poor camera does not."""
        return self.significant and self.spread <= _LOCAL_SPREAD

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
    """Root mean square length of the neighbourhoods' medians, noise taken off."""
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
    near, count = _medians(at, off, _REACHES[0] * pitch_mm)
    ready = np.isfinite(near).all(axis=1)
    if ready.sum() < _LEAST_DOTS:
        return ResidualField(float(np.std(off)), 0.0, None)
    others, _ = _medians(at, off, _REACHES[0] * pitch_mm, itself=False)
    # The other k - 1 dots' median adds pi / 2 (k - 1) of a dot's variance.
    alone = (off - others)[ready] / np.sqrt(1 + np.pi / (2 * (count[ready] - 1)))[:, None]
    own = max(1.4826 * float(np.median(np.abs(alone))), 1e-9)
    squared = (near[ready] ** 2).sum(axis=1) - np.pi * own**2 / count[ready]
    shared = float(np.sqrt(max(squared.mean(), 0.0)))
    found = [_largest(at, off, own, reach * pitch_mm) for reach in _REACHES]
    return ResidualField(own, shared, max(found, key=lambda bump: bump.sigmas))


def _medians(at: Array, off: Array, reach_mm: float, itself: bool = True) -> tuple[Array, Array]:
    """Medians (n, 2) over all dots within reach, and how many (n,) they are."""
    near = cKDTree(at).query_ball_point(at, reach_mm)
    count = np.array([len(k) for k in near], dtype=float)
    chosen = near if itself else [[j for j in k if j != i] or k for i, k in enumerate(near)]
    medians = np.array([np.median(off[k], axis=0) for k in chosen])
    medians[count < _LEAST_DOTS] = np.nan
    return medians, count


def _largest(at: Array, off: Array, own: float, reach_mm: float) -> ResidualBump:
    medians, count = _medians(at, off, reach_mm)
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
