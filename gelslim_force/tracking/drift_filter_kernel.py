"""Compiled step of the filter that follows the drift. Import it only where it runs (numba).

Vectors (4,) and matrices (4, 4) are over shift x, shift y, scale and rotation.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from gelslim_force.detection.darkness_kernel import COMPILED


@njit(**COMPILED)
def combined(
    known: Any, covariance: Any, load: Any, found: Any, fit: Any, measured: Any, jump: Any
) -> Any:
    """Combine the drift known before with the fit of a frame.

    Args:
        known: (4,) drift by the frames before.
        covariance: (4, 4) of it by noise; after a jump, `jump` is added to it in place.
        load: (4,) variances of it by the load's own motion.
        found: (4,) drift of the frame.
        fit: (4, m) dependence of `found` on the m coordinates of the markers.
        measured: Variance of a coordinate, variances (4,) of `found` by the load's own motion.
        jump: Squared distance, in standard deviations, beyond which the drift known before has no
            part in the estimate, and variances (4,) of an unknown drift.

    Returns:
        The share (4, 4) of the frame in the estimate, and the estimate (4,).
    """
    noise, own = measured
    most, unknown = jump
    step = found - known
    before = covariance + np.diag(load)
    total = before + noise * (fit @ fit.T) + np.diag(own)
    if step @ np.linalg.solve(total, step) > most:
        for i in range(4):
            covariance[i, i] += unknown[i]
            before[i, i] += unknown[i]
            total[i, i] += unknown[i]
    share = np.ascontiguousarray(np.linalg.solve(total, before).T)
    return share, known + share @ step


@njit(**COMPILED)
def left_over(covariance: Any, share: Any) -> Any:
    """(4, 4) covariance of the drift known before that a share (4, 4) of a frame leaves."""
    left = np.eye(4) - share
    return left @ covariance @ left.T


@njit(**COMPILED)
def squared_sigmas(covariance: Any, vector: Any) -> Any:
    """Squared length of a vector (4,) in standard deviations."""
    return vector @ np.linalg.solve(covariance, vector)
