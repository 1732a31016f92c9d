"""Exact refraction through flat layers.

A ray that leaves the camera in air at angle θ0 from the layers' normal crosses layer i at
sin θi = sin θ0 / ni and reaches r(θ0) = Σ hi tan θi sideways (Snell). With t = tan θ0 that is

    r(t) = Σ hi t / sqrt(ni² + (ni² - 1) t²),

a sum of positive terms without cancellation, from the normal ray to grazing. `ray_slope` inverts
it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

MAX_NEWTON_STEPS = 60
# t |r''| <= 3 r' term by term, so a Newton step of δt leaves at most about 1.5 (δt/t)² t.
SETTLED = 1e-8
# Below this slope the grazing start is never the better one; the root it costs is saved.
STEEP = 0.5
STEEPEST = 1e150
# Compiling costs about a second and loading the compiled loop 0.3 s: it pays on long arrays only.
COMPILED_FROM = 20_000


def lateral_reach(
    slope: ArrayLike, heights_mm: Sequence[ArrayLike], indices: Sequence[ArrayLike]
) -> Array:
    """Sideways reach (mm) of rays with slope tan θ0 in air through layers; odd in the slope.

    `slope` and each height (mm) and index broadcast together; an air layer has index 1.
    """
    t = np.asarray(slope, dtype=float)
    heights = [np.asarray(h, dtype=float) for h in heights_mm]
    return np.asarray(t * reach_per_slope(t, heights, indices), dtype=float)


def reach_per_slope(
    slope: ArrayLike, heights_mm: Sequence[ArrayLike], indices: Sequence[ArrayLike]
) -> Array:
    """r(t)/t in mm: Σ h / sqrt(n² + (n² - 1) t²), finite for the normal ray (the height seen)."""
    t = np.asarray(slope, dtype=float)
    total = np.zeros(np.broadcast_shapes(t.shape, *(np.shape(h) for h in heights_mm)))
    for height, index in zip(heights_mm, indices, strict=True):
        n = np.asarray(index, dtype=float)
        total = total + np.asarray(height) * (1 / np.sqrt(n * n + (n - 1) * (n + 1) * t * t))
    return np.asarray(total, dtype=float)


def reach_growth(
    slope: ArrayLike, heights_mm: Sequence[ArrayLike], indices: Sequence[ArrayLike]
) -> Array:
    """dr/dt in mm per unit slope: Σ h n² / (n² + (n² - 1) t²)^1.5."""
    t = np.asarray(slope, dtype=float)
    total = np.zeros(np.broadcast_shapes(t.shape, *(np.shape(h) for h in heights_mm)))
    for height, index in zip(heights_mm, indices, strict=True):
        n = np.asarray(index, dtype=float)
        w = 1 / np.sqrt(n * n + (n - 1) * (n + 1) * t * t)
        total = total + np.asarray(height) * w * (n * n) * w * w
    return np.asarray(total, dtype=float)


def ray_slope(
    reach_mm: ArrayLike, heights_mm: Sequence[ArrayLike], indices: Sequence[ArrayLike]
) -> Array:
    """Slope tan θ0 in air of the ray that ends `reach_mm` sideways; odd in the reach.

    Layer 0 is the air (index 1, height > 0), the others have index >= 1 and height >= 0; all
    broadcast together. The slope is right to a few rounding errors of the reach, from a reach
    of zero (slope 0) to grazing. A NaN reach gives NaN. Long arrays run in a compiled loop,
    which gives the same digits.
    Raises ValueError for a missing air gap, an index or a height out of range, a reach beyond
    1e150 times the air gap.
    """
    signed = np.asarray(reach_mm, dtype=float)
    heights = [np.asarray(h, dtype=float) for h in heights_mm]
    media = [np.asarray(n, dtype=float) for n in indices]
    _check_layers(heights, media)
    r = np.abs(signed)
    if np.any(r > STEEPEST * heights[0]):
        raise ValueError(
            f"a reach of {np.nanmax(r):g} mm is beyond the limit of {STEEPEST:g} air gaps"
        )
    shape = np.broadcast_shapes(r.shape, *(a.shape for a in heights + media))
    size = int(np.prod(shape))
    if size >= COMPILED_FROM:
        from gelslim_optics.camera.refraction_kernel import solve_slopes

        slope = solve_slopes(np.broadcast_to(r, shape), heights, media)
    else:
        slope = newton_slope(r, heights, media)
    return np.copysign(slope, np.broadcast_to(signed, slope.shape))


def newton_slope(r: Array, heights_mm: Sequence[Array], indices: Sequence[Array]) -> Array:
    """Reference for the compiled loop: slope of reaches `r` >= 0, unchecked.

    Newton on t. The reach is increasing and concave in t and lies below both t Σ h/n and its
    asymptote, so from the larger of those two bounds the iteration climbs to the root and never
    passes it; a ray whose step has become small (or, by rounding, negative) is left as it is.
    """
    n2 = [n * n for n in indices]
    m2 = [(n - 1) * (n + 1) for n in indices]
    t = r / sum(h / n for h, n in zip(heights_mm, indices, strict=True))
    steep = t > STEEP
    if steep.any():
        bound = _grazing_bound(r, heights_mm, m2)
        t = np.where(steep & (bound > t), bound, t)
    moving = np.ones(t.shape, dtype=bool)
    for _ in range(MAX_NEWTON_STEPS):
        seen = np.zeros_like(t)
        growth = np.zeros_like(t)
        for h, a, b in zip(heights_mm, n2, m2, strict=True):
            w = 1 / np.sqrt(a + b * t * t)
            seen = seen + h * w
            growth = growth + h * w * a * w * w
        step = (r - t * seen) / growth
        moved = t + step
        settled = ~(step > SETTLED * t)
        t = np.where(moving, moved, t)
        moving &= ~settled
        if not moving.any():
            break
    return np.asarray(t, dtype=float)


def _grazing_bound(r: Array, heights_mm: Sequence[Array], m2: Sequence[Array]) -> Array:
    """Where the reach's asymptote, Σ h/sqrt(n² - 1) + t h_air, attains `r`: below the root."""
    sideways: Array | float = 0.0
    air: Array | float = 0.0
    for h, b in zip(heights_mm, m2, strict=True):
        dense = b > 0
        sideways = sideways + np.where(dense, h / np.sqrt(np.where(dense, b, 1.0)), 0.0)
        air = air + np.where(dense, 0.0, h)
    return np.asarray((r - sideways) / air, dtype=float)


def _check_layers(heights_mm: Sequence[Array], indices: Sequence[Array]) -> None:
    if not heights_mm or len(heights_mm) != len(indices):
        raise ValueError(
            f"{len(heights_mm)} layer heights but {len(indices)} indices: give one of each per "
            "layer, the air first"
        )
    if not np.all(heights_mm[0] > 0):
        raise ValueError("the air gap between camera and window must be positive")
    if not np.all(indices[0] == 1):
        raise ValueError("layer 0 is the air: its index is 1, the others count relative to it")
    for k, (height, index) in enumerate(zip(heights_mm, indices, strict=True)):
        if not (np.all(height >= 0) and np.all(np.isfinite(height))):
            raise ValueError(
                f"layer {k} has a height of {np.min(height):g} mm: it must be finite and not "
                "below zero"
            )
        if not (np.all(index >= 1) and np.all(np.isfinite(index))):
            raise ValueError(
                f"layer {k} has an index of {np.min(index):g}: it must be finite and at least 1"
            )
