"""Compiled deviation of markers from their neighbours. Import it only where it runs (numba)."""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from gelslim_force.detection.darkness_kernel import COMPILED


@njit(**COMPILED)
def deviations(motion: Any, near: Any, found: Any) -> int:
    """Write the motion of markers minus the mean of their four neighbours on the lattice.

    Args:
        motion: (n, 2), NaN where unknown.
        near: (n, k) neighbours, the nearest first, or -1.
        found: (n, 2), of which the first rows are written.

    Returns:
        Number of rows: of markers with four neighbours, all with a known motion.
    """
    count = 0
    for i in range(len(motion)):
        a, b, c, d = near[i, 0], near[i, 1], near[i, 2], near[i, 3]
        if min(min(a, b), min(c, d)) < 0:
            continue
        for axis in range(2):
            around = motion[a, axis] + motion[b, axis] + motion[c, axis] + motion[d, axis]
            found[count, axis] = motion[i, axis] - around / 4
        if math.isfinite(found[count, 0]) and math.isfinite(found[count, 1]):
            count += 1
    return count
