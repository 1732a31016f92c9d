"""How large the errors of the markers and the traction are, as the fit of one frame shows it.

The weights with which forces are estimated from the markers alone hold more than most contacts
have: what is left open by the region, and tractions as large and rough as the gel can bear. The
covariance of the forces has a part by the markers and a part by the prior of the traction. Each is
scaled by the mean square of its own residuals, over its share of the redundancy: K. R. Koch,
"Parameter estimation and hypothesis testing in linear models", 1999, §3.6, on variance components.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from gelslim_force.joint.markers.rows import MarkerRows

Array = NDArray[np.float64]


def scaled_covariance(
    hessian: Array, rows: MarkerRows, sums: Array, spread: Array, force: Array
) -> Array:
    """Covariance (k, k) of linear functions of the forces, by the residuals of markers and prior.

    The part of the prior is not made larger, as its weights are the largest that are plausible.

    Args:
        hessian: (3p, 3p) of markers and prior.
        rows: The markers.
        sums: (k, 3p) linear functions of the forces.
        spread: (k, 3p) their product with the covariance of the forces by these weights.
        force: (3p,) forces.
    """
    free = spread.any(axis=0)
    if not free.any():
        return np.zeros((len(sums), len(sums)))
    root = np.sqrt(rows.weight)
    gain = (spread @ rows.rows.T) * root
    by_markers = gain @ gain.T
    by_prior = spread @ sums.T - by_markers
    data = rows.rows[:, free].astype(float) * root[:, None]
    shown = float(np.trace(cho_solve(cho_factor(hessian[np.ix_(free, free)]), data.T @ data)))
    moved = root * (rows.rows @ force)
    size = float(force @ hessian @ force - moved @ moved) / shown
    misfit = float(rows.weight @ np.square(rows.residual)) / max(len(root) - shown, 1.0)
    return np.asarray(misfit * by_markers + min(1.0, size) * by_prior)
