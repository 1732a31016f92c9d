"""How restless the markers are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_force.lattice.reference_lattice import ReferenceLattice

Array = NDArray[np.float64]
_FEWEST = 8
_QUARTER = 0.31864
"""Lower quartile of the absolute value of a standard normal number."""


def noise_px(reference: ReferenceLattice, displacement_px: Array) -> float:
    """Standard deviation in px of one marker coordinate, from one frame's displacements (n, 2).

    A marker's displacement less the mean of its four lattice neighbours' has 1.25 times the
    variance of one. The lower quartile does not see those that curve around a contact. NaN
    displacements are left out; 0 where fewer than eight markers have four neighbours.
    """
    near = reference.neighbours[:, :4]
    whole = (near >= 0).all(axis=1)
    around = displacement_px[near[whole]].mean(axis=1)
    off = displacement_px[whole] - around
    return quiet_sigma(off[np.isfinite(off).all(axis=1)]) / np.sqrt(1.25)


def quiet_sigma(values: Array) -> float:
    """Standard deviation of numbers about 0 of which up to three quarters may hold more than
    noise, from their lower quartile; 0 for fewer than eight rows."""
    if len(values) < _FEWEST:
        return 0.0
    return float(np.quantile(np.abs(values), 0.25) / _QUARTER)
