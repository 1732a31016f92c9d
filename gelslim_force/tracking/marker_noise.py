"""Standard deviation of the noise of marker positions, estimated from a frame."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gelslim_force.frames.read_only import read_only
from gelslim_force.lattice.reference_lattice import ReferenceLattice

Array = NDArray[np.float64]
_MIN_VALUES = 8
_QUARTILE = 0.31864
"""Lower quartile of the absolute value of a standard normal variable."""


def noise_px(reference: ReferenceLattice, displacement_px: Array) -> float:
    """Return the standard deviation of one coordinate from a frame's displacements (n, 2) in px.

    The displacement of a marker minus the mean of its four lattice neighbours has 1.25 times the
    variance of one displacement. The lower quartile ignores the markers around a contact, whose
    displacement varies. Unknown displacements (NaN) are ignored. The result is 0 if fewer than
    eight markers have four neighbours.
    """
    from gelslim_force.tracking.noise_kernel import deviations

    off = np.empty((len(reference), 2))
    count = deviations(read_only(displacement_px), reference.neighbours, off)
    return robust_sigma(off[:count]) / math.sqrt(1.25)


def robust_sigma(values: Array) -> float:
    """Return the standard deviation about 0 from the lower quartile; 0 for fewer than 8 rows.

    Up to three quarters of the values may contain more than noise.
    """
    if len(values) < _MIN_VALUES:
        return 0.0
    sizes = np.abs(values).ravel()
    at = 0.25 * (sizes.size - 1)
    below = int(at)
    # np.quantile gives the same and takes six times as long.
    first, second = np.partition(sizes, (below, below + 1))[below : below + 2].tolist()
    return float((first + (at - below) * (second - first)) / _QUARTILE)
