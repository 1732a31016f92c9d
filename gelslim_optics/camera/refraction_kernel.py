"""Compiled Newton's method for the slopes of many rays. Importing this module loads numba.

Each ray takes the same operations in the same order as in `refraction.newton_slope`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gelslim_optics.camera.refraction import MAX_NEWTON_STEPS, RELATIVE_STEP, STEEP_SLOPE

Array = NDArray[np.float64]

COMPILED = {"cache": True, "nogil": True, "error_model": "numpy", "_nrt": False}
INLINED = {**COMPILED, "forceinline": True}


@njit(**INLINED)
def slope_of(r: Any, h: Any, n: Any, n2: Any, m2: Any) -> Any:
    """Slope in air of one ray of reach r >= 0 through layers h (L,), indices n (L,)."""
    layers = h.size
    paraxial = 0.0
    for k in range(layers):
        paraxial = paraxial + h[k] / n[k]
    t = r / paraxial
    if t > STEEP_SLOPE:
        sideways = 0.0
        air = 0.0
        for k in range(layers):
            if m2[k] > 0:
                sideways = sideways + h[k] / math.sqrt(m2[k])
            else:
                air = air + h[k]
        bound = (r - sideways) / air
        if bound > t:
            t = bound
    for _ in range(MAX_NEWTON_STEPS):
        reach_per_t = 0.0
        growth = 0.0
        for k in range(layers):
            w = 1 / math.sqrt(n2[k] + m2[k] * t * t)
            reach_per_t = reach_per_t + h[k] * w
            growth = growth + h[k] * w * n2[k] * w * w
        step = (r - t * reach_per_t) / growth
        converged = not (step > RELATIVE_STEP * t)
        t = t + step
        if converged:
            break
    return t


@njit(**COMPILED)
def slopes(
    reach: Any, heights: Any, h_first: Any, h_stride: Any, media: Any, n_first: Any, n_stride: Any,
    work: Any, out: Any,
) -> None:  # fmt: skip
    """Slopes `out` (n,); layer k of ray i has the height heights[h_first[k] + h_stride[k] i]."""
    h, n, n2, m2 = work[0], work[1], work[2], work[3]
    for i in range(reach.size):
        for k in range(h.size):
            h[k] = heights[h_first[k] + h_stride[k] * i]
            if i == 0 or n_stride[k] > 0:
                n[k] = media[n_first[k] + n_stride[k] * i]
                n2[k] = n[k] * n[k]
                m2[k] = (n[k] - 1) * (n[k] + 1)
        out[i] = slope_of(reach[i], h, n, n2, m2)


@njit(**COMPILED)
def rays_to_points(
    points: Any, pinhole: Any, axes: Any, tops: Any, index: Any, work: Any, out: Any
) -> None:
    """Rays in air to `points` (n, 3), on the camera's axes; points that are not finite give NaN.

    `axes` (3, 3) has right, down and forward as rows; `tops` (L,) are the heights at which the
    layers end (inf for the last), `index` (L,) their indices, the air first; `work` (4, L) is
    work space; the result goes to `out` (n, 3).
    """
    h, n, n2, m2 = work[0], work[1], work[2], work[3]
    for k in range(index.size):
        n[k] = index[k]
        n2[k] = n[k] * n[k]
        m2[k] = (n[k] - 1) * (n[k] + 1)
    for i in range(points.shape[0]):
        x = points[i, 0] - pinhole[0]
        y = points[i, 1] - pinhole[1]
        z = points[i, 2]
        if not math.isfinite(x + y + z):
            out[i, 0] = out[i, 1] = out[i, 2] = math.nan
            continue
        floor = pinhole[2]
        for k in range(index.size):
            h[k] = max(min(z, tops[k]) - floor, 0.0)
            floor = max(floor, tops[k])
        r = math.sqrt(x * x + y * y)
        scale = slope_of(r, h, n, n2, m2) / r if r > 0 else 0.0
        x = x * scale
        y = y * scale
        for k in range(3):
            out[i, k] = axes[k, 0] * x + axes[k, 1] * y + axes[k, 2]


def solve_rays(
    points_mm: Array, pinhole_mm: Array, axes: Array, tops: Array, index: Array
) -> Array:
    """`rays.newton_rays` (n, 3), compiled."""
    out = np.empty(points_mm.shape)
    work = np.empty((4, index.size))
    rays_to_points(np.ascontiguousarray(points_mm), pinhole_mm, axes, tops, index, work, out)
    return out


def _packed(arrays: Sequence[Array], shape: tuple[int, ...]) -> tuple[Array, Any, Any]:
    """Values of all layers in one array, where each layer starts, and whether it varies by ray."""
    parts = [np.broadcast_to(a, shape).ravel() if a.size > 1 else np.reshape(a, 1) for a in arrays]
    first = np.cumsum([0, *(p.size for p in parts[:-1])])
    stride = np.array([1 if a.size > 1 else 0 for a in arrays])
    return np.concatenate(parts), first, stride


def solve_slopes(reach: Array, heights_mm: Sequence[Array], indices: Sequence[Array]) -> Array:
    """`refraction.newton_slope` for a broadcast `reach` of any shape, compiled."""
    out = np.empty(reach.size)
    work = np.empty((4, len(heights_mm)))
    slopes(
        np.ascontiguousarray(reach).ravel(),
        *_packed(heights_mm, reach.shape),
        *_packed(indices, reach.shape),
        work,
        out,
    )
    return out.reshape(reach.shape)
