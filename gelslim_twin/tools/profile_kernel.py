"""Compiled lower surfaces of round and of convex shapes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

LEVEL = 1e-9
"""Vertical part of a unit normal below which a face counts as upright."""


@njit(cache=True)
def arc_heights(radius: float, reach: Any, height: Any) -> None:
    """height (n,) of a circle over its lowest point at distances `reach` (n,) from it."""
    for i in range(len(reach)):
        if reach[i] <= radius:
            # r² / (R + √(R² - r²)) keeps its digits near the pole, R - √(R² - r²) does not.
            square = reach[i] * reach[i]
            height[i] = square / (radius + math.sqrt(max(radius * radius - square, 0.0)))
        else:
            height[i] = np.inf


@njit(cache=True)
def convex_heights(normals: Any, reach: Any, margin_mm: float, x: Any, y: Any, height: Any) -> None:
    """height (n,) of the lower surface of the points p with n·p <= reach for m outer normals.

    Infinite beside the body; points outside by less than `margin_mm` count as on it.
    """
    for i in range(len(x)):
        low, high, inside = -np.inf, np.inf, True
        for k in range(len(reach)):
            room = reach[k] - (x[i] * normals[k, 0] + y[i] * normals[k, 1])
            if normals[k, 2] < -LEVEL:
                low = max(low, room / normals[k, 2])
            elif normals[k, 2] > LEVEL:
                high = min(high, room / normals[k, 2])
            elif room < -margin_mm:
                inside = False
                break
        height[i] = low if inside and low <= high + margin_mm else np.inf
