"""Compiled points of rays at given heights. Importing this module loads numba."""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from gelslim_optics.camera.refraction_kernel import COMPILED


@njit(**COMPILED)
def points_at(
    image: Any, axes: Any, pinhole: Any, tops: Any, index: Any, height: Any, out: Any
) -> int:
    """Write the points (n, 3) at heights (n,) on the rays of undistorted image points (n, 2).

    Image points are in focal lengths; `axes` (3, 3) has right, down and forward as rows; `tops`
    (L,) are the heights at which the layers end, `index` (L,) their indices, the air first.

    Returns:
        Number of rays that do not rise; their points are invalid.
    """
    missed = 0
    for i in range(len(image)):
        x = image[i, 0] * axes[0, 0] + image[i, 1] * axes[1, 0] + axes[2, 0]
        y = image[i, 0] * axes[0, 1] + image[i, 1] * axes[1, 1] + axes[2, 1]
        z = image[i, 0] * axes[0, 2] + image[i, 1] * axes[1, 2] + axes[2, 2]
        missed += z <= 0
        x, y = x / z, y / z
        squared, reach, floor = x * x + y * y, 0.0, pinhole[2]
        for k in range(len(index)):
            path = max(min(height[i], tops[k]) - floor, 0.0)
            n = index[k]
            reach += path / math.sqrt(n * n + (n - 1) * (n + 1) * squared)
            floor = max(floor, tops[k])
        out[i, 0] = pinhole[0] + x * reach
        out[i, 1] = pinhole[1] + y * reach
        out[i, 2] = height[i]
    return missed
