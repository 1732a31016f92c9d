"""How restless the markers are, and how restless that makes each node's force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_force.force_estimator import SurfaceForce
from gelslim_force.reference_lattice import ReferenceLattice
from gelslim_force.surface_motion import SurfaceMotion

Array = NDArray[np.float64]
_DRAWS, _SEED = 16, 20190521
_FEWEST = 8
_QUARTER = 0.31864
"""Lower quartile of the absolute value of a standard normal number."""


def noise_px(reference: ReferenceLattice, displacement_px: Array) -> float:
    """Standard deviation in px of one marker coordinate, from one frame's displacements (n, 2).

    A marker's displacement less the mean of its four lattice neighbours' has 1.25 times the
    variance of one. The lower quartile does not see those that curve around a contact. NaN
    displacements are left out; NaN where fewer than eight markers have four neighbours.
    """
    near = reference.neighbours[:, :4]
    whole = (near >= 0).all(axis=1)
    around = displacement_px[near[whole]].mean(axis=1)
    off = displacement_px[whole] - around
    off = off[np.isfinite(off).all(axis=1)]
    if len(off) < _FEWEST:
        return float("nan")
    return float(np.quantile(np.abs(off), 0.25) / _QUARTER / np.sqrt(1.25))


def node_noise_n_per_px(law: SurfaceForce, motion: SurfaceMotion) -> Array:
    """(c,) size of the tangential force that unit marker noise makes at each node, in N/px.

    The root mean square of draws from a fixed seed.
    """
    rng = np.random.default_rng(_SEED)
    total = np.zeros(len(motion.points_mm))
    for _ in range(_DRAWS):
        moved = motion.of_noise(rng.normal(size=(len(motion.view), 2)))
        total += (law.force(moved)[:, :2] ** 2).sum(axis=1)
    return np.asarray(np.sqrt(total / _DRAWS))
