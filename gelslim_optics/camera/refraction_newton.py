"""Newton's method for the slope of a ray through flat layers, for arrays and for single numbers.

`rays` calls these functions with arrays. `refraction_kernel` compiles the same functions and calls
them with one number per argument. They use only operations that mean the same in both cases;
`choose` selects one of two values. Layer 0 is the air, with index 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

MAX_NEWTON_STEPS = 60
# t |r''| <= 3 r' term by term, so a Newton step of δt leaves at most about 1.5 (δt/t)² t.
RELATIVE_STEP = 1e-8
# Below this slope the asymptotic start is never the better one; its square root is saved.
STEEP_SLOPE = 0.5


def choose(condition: Any, if_true: Any, if_false: Any) -> Any:
    """The second argument where the condition holds, else the third; both are evaluated."""
    return np.where(condition, if_true, if_false)


def slope_ratio(slope: Any, index: Any) -> Any:
    """Slope of the ray in a layer per slope in air: 1 / sqrt(n² + (n² - 1) t²)."""
    return 1 / np.sqrt(index * index + (index - 1) * (index + 1) * slope * slope)


def apparent_height(slope: Any, heights_mm: Sequence[Any], indices: Sequence[Any]) -> Any:
    """The reach per slope, r(t)/t in mm; for the normal ray the apparent height of the layers."""
    total = 0.0
    for k in range(len(indices)):
        height, index = heights_mm[k], indices[k]
        total = total + height * slope_ratio(slope, index)
    return total


def newton_slope(reach_mm: Any, heights_mm: Sequence[Any], indices: Sequence[Any]) -> Any:
    """Slope in air of the rays with reaches >= 0 in mm; the input is not checked.

    Newton's method for t. The reach is increasing and concave in t and lies below both t Σ h/n and
    its asymptote. From the larger of the two starts that these give, the iteration increases to
    the root and never passes it. A ray whose step is small (or, by rounding, negative) is final.
    """
    t = _starting_slope(reach_mm, heights_mm, indices)
    moving = t >= 0
    for _ in range(MAX_NEWTON_STEPS):
        reach_per_t, growth = heights_mm[0], heights_mm[0]
        for k in range(1, len(indices)):
            height, index = heights_mm[k], indices[k]
            ratio = slope_ratio(t, index)
            reach_per_t = reach_per_t + height * ratio
            growth = growth + height * ratio * (index * index) * ratio * ratio
        step = (reach_mm - t * reach_per_t) / growth
        still_moving = moving & (step > RELATIVE_STEP * t)
        t = choose(moving, t + step, t)
        moving = still_moving
        if not np.any(moving):
            break
    return t


def _starting_slope(reach_mm: Any, heights_mm: Sequence[Any], indices: Sequence[Any]) -> Any:
    """The larger of the paraxial and the asymptotic bound; neither exceeds the slope."""
    paraxial = heights_mm[0]
    for k in range(1, len(indices)):
        paraxial = paraxial + heights_mm[k] / indices[k]
    t = reach_mm / paraxial
    steep = t > STEEP_SLOPE
    if np.any(steep):
        bound = _asymptotic_bound(reach_mm, heights_mm, indices)
        t = choose(steep & (bound > t), bound, t)
    return t


def _asymptotic_bound(reach_mm: Any, heights_mm: Sequence[Any], indices: Sequence[Any]) -> Any:
    """Slope at which the asymptote Σ h/sqrt(n² - 1) + t h_air attains the reach."""
    sideways, air = 0.0, heights_mm[0]
    for k in range(1, len(indices)):
        height, index = heights_mm[k], indices[k]
        excess = (index - 1) * (index + 1)
        dense = excess > 0
        sideways = sideways + choose(dense, height / np.sqrt(choose(dense, excess, 1.0)), 0.0)
        air = air + choose(dense, 0.0, height)
    return (reach_mm - sideways) / air


SHARED = (slope_ratio, apparent_height, newton_slope, _starting_slope, _asymptotic_bound)
"""The functions that `refraction_kernel` compiles besides `choose`."""
