"""Compiled Newton's method for the slopes of many rays. Importing this module loads numba.

Each ray's slope comes from `refraction_newton.newton_slope`, which is compiled here for numbers.
"""

from __future__ import annotations

import inspect
import math
import zlib
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numba import njit
from numba.extending import overload, register_jitable
from numpy.typing import NDArray

from gelslim_optics.camera import refraction_newton
from gelslim_optics.camera.refraction_newton import choose, newton_slope

Array = NDArray[np.float64]

COMPILED = {"cache": True, "nogil": True, "error_model": "numpy", "_nrt": False}
INLINED = {"error_model": "numpy", "_nrt": False, "forceinline": True}


@overload(choose, strict=False, jit_options=INLINED)
def _choose_number(condition: Any, if_true: Any, if_false: Any) -> Any:
    return lambda condition, if_true, if_false: if_true if condition else if_false


def let_compile(functions: Sequence[Callable[..., Any]]) -> None:
    """Let compiled loops call these plain functions."""
    for function in functions:
        register_jitable(**INLINED)(function)


def source_key(*modules: ModuleType) -> int:
    """A number that changes with the source of the modules.

    numba compiles cached code again when the file of the loop has changed, but not when the file
    of a function that the loop calls has. A loop whose closure holds this number follows both.
    """
    return zlib.crc32("".join(map(inspect.getsource, modules)).encode())


let_compile(refraction_newton.SHARED)


def _compile(source: int) -> tuple[Callable[..., None], Callable[..., None]]:
    @njit(**COMPILED)
    def slopes(
        reach: Any, heights: Any, h_first: Any, h_stride: Any, media: Any, n_first: Any,
        n_stride: Any, work: Any, out: Any,
    ) -> None:  # fmt: skip
        """Slopes `out` (n,); layer k of ray i has the height heights[h_first[k] + h_stride[k] i].

        Its index is found in `media` likewise; `work` (2, L) is work space.
        """
        source  # noqa: B018
        h, n = work[0], work[1]
        for i in range(reach.size):
            for k in range(h.size):
                h[k] = heights[h_first[k] + h_stride[k] * i]
                n[k] = media[n_first[k] + n_stride[k] * i]
            out[i] = newton_slope(reach[i], h, n)

    @njit(**COMPILED)
    def rays_to_points(
        points: Any, pinhole: Any, axes: Any, tops: Any, index: Any, h: Any, out: Any
    ) -> None:
        """Rays in air to `points` (n, 3), on the camera's axes; points not finite give NaN.

        `axes` (3, 3) has right, down and forward as rows; `tops` (L,) are the heights at which the
        layers end (inf for the last), `index` (L,) their indices, the air first; `h` (L,) is work
        space; the result goes to `out` (n, 3).
        """
        source  # noqa: B018
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
            scale = newton_slope(r, h, index) / r if r > 0 else 0.0
            x = x * scale
            y = y * scale
            for k in range(3):
                out[i, k] = axes[k, 0] * x + axes[k, 1] * y + axes[k, 2]

    return slopes, rays_to_points


_slopes, _rays_to_points = _compile(source_key(refraction_newton))


def solve_rays(
    points_mm: Array, pinhole_mm: Array, axes: Array, tops: Array, index: Array
) -> Array:
    """`rays.newton_rays` (n, 3), compiled."""
    out = np.empty(points_mm.shape)
    work = np.empty(index.size)
    _rays_to_points(np.ascontiguousarray(points_mm), pinhole_mm, axes, tops, index, work, out)
    return out


def _packed(arrays: Sequence[Array], shape: tuple[int, ...]) -> tuple[Array, Any, Any]:
    """Values of all layers in one array, where each layer starts, and whether it varies by ray."""
    parts = [np.broadcast_to(a, shape).ravel() if a.size > 1 else np.reshape(a, 1) for a in arrays]
    first = np.cumsum([0, *(p.size for p in parts[:-1])])
    stride = np.array([1 if a.size > 1 else 0 for a in arrays])
    return np.concatenate(parts), first, stride


def solve_slopes(reach: Array, heights_mm: Sequence[Array], indices: Sequence[Array]) -> Array:
    """`newton_slope` for a broadcast `reach` of any shape, compiled."""
    out = np.empty(reach.size)
    _slopes(
        np.ascontiguousarray(reach).ravel(),
        *_packed(heights_mm, reach.shape),
        *_packed(indices, reach.shape),
        np.empty((2, len(heights_mm))),
        out,
    )
    return out.reshape(reach.shape)
