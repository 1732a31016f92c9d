"""Exact refraction through flat layers.

A ray that leaves the camera in air at angle θ0 from the layers' normal crosses layer i at
sin θi = sin θ0 / ni and reaches r(θ0) = Σ hi tan θi sideways (Snell). `ray_slope` inverts r(θ0).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

MAX_NEWTON_STEPS = 60


def lateral_reach(
    slope: ArrayLike, heights_mm: Sequence[ArrayLike], indices: Sequence[ArrayLike]
) -> NDArray[np.float64]:
    """Sideways reach (mm) of a ray with slope tan θ0 in air; layer 0 is the air (index 1)."""
    t = np.asarray(slope, dtype=float)
    s2 = t * t / (1 + t * t)
    reach = np.zeros(np.broadcast_shapes(t.shape, *(np.shape(h) for h in heights_mm)))
    for height, index in zip(heights_mm, indices, strict=True):
        n = np.asarray(index, dtype=float)
        reach = reach + np.asarray(height) * np.sqrt(s2 / (n * n - s2))
    return np.copysign(reach, np.broadcast_to(t, reach.shape))


def ray_slope(
    reach_mm: ArrayLike, heights_mm: Sequence[ArrayLike], indices: Sequence[ArrayLike]
) -> NDArray[np.float64]:
    """Slope tan θ0 in air of the ray that ends `reach_mm` sideways.

    Newton on t = tan θ0. For indices >= 1 the reach is increasing and concave in t > 0 and at
    most t Σhi, so from r/Σhi the iteration climbs to the root and never passes it.
    Raises ValueError unless the air height is positive.
    """
    if np.any(np.asarray(heights_mm[0]) <= 0):
        raise ValueError("the air gap between camera and window must be positive")
    r = np.abs(np.asarray(reach_mm, dtype=float))
    total = sum(np.asarray(h, dtype=float) for h in heights_mm)
    t = np.asarray(r / total, dtype=float)
    for _ in range(MAX_NEWTON_STEPS):
        s2 = t * t / (1 + t * t)
        value = -r
        slope = np.zeros_like(t)
        for height, index in zip(heights_mm, indices, strict=True):
            n2 = np.asarray(index, dtype=float) ** 2
            cos2 = n2 - s2
            root = np.sqrt(cos2)
            # dr/dt of h s/sqrt(n²-s²) with s = t/sqrt(1+t²)
            value = value + height * np.sqrt(s2) / root
            slope = slope + height * n2 / (cos2 * root) * (1 - s2) ** 1.5
        step = -value / slope
        t = np.maximum(t + step, 0.0)
        if np.all(np.abs(step) <= 1e-15 * (1 + t)):
            break
    return np.copysign(t, np.broadcast_to(np.asarray(reach_mm, dtype=float), t.shape))
