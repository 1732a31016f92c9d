"""Compiled Newton's method for undistorting points. Importing this module loads numba."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit

from gelslim_optics.camera import radial_scale as radial
from gelslim_optics.camera import refraction_kernel, refraction_newton
from gelslim_optics.camera.radial_scale import radial_scale
from gelslim_optics.camera.refraction_kernel import COMPILED, let_compile, source_key

MAX_STEPS = 12
TOLERANCE = 1e-15

let_compile(radial.SHARED)


def _compile(source: int) -> Callable[..., None]:
    @njit(**COMPILED)
    def compiled(target: Any, k: Any, fisheye: Any, radius: Any, out: Any, converged: Any) -> None:
        """Undistorted points of `target` (n, 2), written to `out`, by undamped Newton steps.

        `k` holds k1, k2, k3, k4, p1, p2. `converged` (n,) is True where the iteration ended within
        `radius`; the other rows are invalid.
        """
        source  # noqa: B018
        p1, p2 = k[4], k[5]
        for n in range(len(target)):
            tx, ty = target[n, 0], target[n, 1]
            x, y = tx, ty
            converged[n] = False
            for _ in range(MAX_STEPS):
                s = x * x + y * y
                f, change = radial_scale(s, fisheye, k[0], k[1], k[2], k[3])
                g = 2 * change
                ex = x * f + 2 * p1 * x * y + p2 * (s + 2 * x * x) - tx
                ey = y * f + p1 * (s + 2 * y * y) + 2 * p2 * x * y - ty
                cross = g * x * y + 2 * p1 * x + 2 * p2 * y
                xx = f + g * x * x + 2 * p1 * y + 6 * p2 * x
                yy = f + g * y * y + 6 * p1 * y + 2 * p2 * x
                det = xx * yy - cross * cross
                if not det > 0:
                    break
                dx, dy = (yy * ex - cross * ey) / det, (xx * ey - cross * ex) / det
                x, y = x - dx, y - dy
                if abs(dx) + abs(dy) <= TOLERANCE * (1 + abs(x) + abs(y)) * 4:
                    converged[n] = x * x + y * y < radius * radius
                    break
            out[n, 0], out[n, 1] = x, y

    return compiled


undistort = _compile(source_key(radial, refraction_newton, refraction_kernel))
