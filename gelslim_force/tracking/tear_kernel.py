"""Compiled signs of a picture in two parts. Import it only where it runs, because it loads numba.

`motion` (n, 2) is that of the markers, NaN for those not seen, and `near` (n, k) are the neighbours
of each on the lattice, the direct ones first, or -1.
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from gelslim_force.detection.darkness_kernel import COMPILED


@njit(**COMPILED)
def strained(motion: Any, near: Any, limit: Any) -> int:
    """Number of pairs of direct neighbours whose motions (n, 2) differ by more than a limit."""
    count = 0
    for i in range(len(motion)):
        for k in range(4):
            j = near[i, k]
            if j >= 0:
                x, y = motion[j, 0] - motion[i, 0], motion[j, 1] - motion[i, 1]
                count += x * x + y * y > limit * limit
    return count // 2


@njit(**COMPILED)
def jump(motion: Any) -> Any:
    """Divide lines with motions (k, 2) in the two parts that move most as one each.

    Returns the share of the lines' motion that the parts explain, the share of the jump from one
    part to the other that happens between two lines, and the size of the jump.
    """
    count = len(motion)
    x, y = motion[:, 0].mean(), motion[:, 1].mean()
    sum_x = sum_y = most = spread = 0.0
    split = before_x = before_y = 0
    for i in range(count):
        u, v = motion[i, 0] - x, motion[i, 1] - y
        spread += u * u + v * v
        sum_x, sum_y = sum_x + u, sum_y + v
        before, after = i + 1, count - i - 1
        if after > 0:
            between = count * (sum_x * sum_x + sum_y * sum_y) / (before * after)
            if between > most:
                most, split, before_x, before_y = between, i, sum_x, sum_y
    share = count / ((split + 1) * (count - split - 1))
    x, y = -share * before_x, -share * before_y
    size = math.hypot(x, y)
    u = motion[split + 1, 0] - motion[split, 0]
    v = motion[split + 1, 1] - motion[split, 1]
    steep = (u * x + v * y) / max(size, 1e-12) ** 2
    return most / max(spread, 1e-300), steep, size
