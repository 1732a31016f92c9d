"""Compiled cubic interpolation of the gel's displacement. Import only where it runs: numba."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def weights(t: Any, w: Any, d: Any) -> None:
    """Write the weights `w` (4,) and slopes `d` (4,) of cubic convolution at 0 <= t <= 1."""
    w[0] = t * (-0.5 + t * (1.0 - 0.5 * t))
    w[1] = 1.0 + t * t * (-2.5 + 1.5 * t)
    w[2] = t * (0.5 + t * (2.0 - 1.5 * t))
    w[3] = t * t * (-0.5 + 0.5 * t)
    d[0] = -0.5 + t * (2.0 - 1.5 * t)
    d[1] = t * (-5.0 + 4.5 * t)
    d[2] = 0.5 + t * (4.0 - 4.5 * t)
    d[3] = t * (-1.0 + 1.5 * t)


@njit(**COMPILED)
def cell_of(at: Any, count: Any) -> Any:
    """Cell and place in it of a coordinate in cells, held to the grid."""
    held = min(max(at, 0.0), count - 1.0)
    i = min(math.floor(held), count - 2)
    return i, held - i


@njit(**COMPILED)
def displacement(padded: Any, origin: Any, step: Any, points: Any, out: Any) -> None:
    """Write the displacement `out` (n, 3) at material points (n, 2).

    `padded` (ny + 2, nx + 2, 3) has one ring of ghost nodes; `origin` and `step` (2,) in mm.
    """
    ny, nx = padded.shape[0] - 2, padded.shape[1] - 2
    wx, wy, d = np.empty(4), np.empty(4), np.empty(4)
    for n in range(points.shape[0]):
        i, u = cell_of((points[n, 0] - origin[0]) / step[0], nx)
        j, v = cell_of((points[n, 1] - origin[1]) / step[1], ny)
        weights(u, wx, d)
        weights(v, wy, d)
        a = b = c = 0.0
        for q in range(4):
            for p in range(4):
                w = wy[q] * wx[p]
                a += w * padded[j + q, i + p, 0]
                b += w * padded[j + q, i + p, 1]
                c += w * padded[j + q, i + p, 2]
        out[n, 0], out[n, 1], out[n, 2] = a, b, c


@njit(**COMPILED)
def seen_slopes(
    padded: Any, origin: Any, step: Any, rest: Any, lean: Any, rounds: Any, slopes: Any, at: Any
) -> None:
    """Write the slopes (n, 2) of the deformed surface where rays meet it, and the points (n, 3).

    A ray is at rest (n, 2) + lean (n, 2) z. The material point X with X + u(X) on the ray is
    found by `rounds` of X = rest + lean u_z(X) - u_xy(X). The slope of the surface carried along
    is (I + du_xy/dX)^-T du_z/dX.
    """
    ny, nx = padded.shape[0] - 2, padded.shape[1] - 2
    wx, wy, dx, dy = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    u, gx, gy = np.empty(3), np.empty(3), np.empty(3)
    for n in range(rest.shape[0]):
        x, y = rest[n, 0], rest[n, 1]
        for k in range(rounds + 1):
            i, s = cell_of((x - origin[0]) / step[0], nx)
            j, t = cell_of((y - origin[1]) / step[1], ny)
            weights(s, wx, dx)
            weights(t, wy, dy)
            u[:] = 0.0
            gx[:] = 0.0
            gy[:] = 0.0
            for q in range(4):
                for p in range(4):
                    for c in range(3):
                        value = padded[j + q, i + p, c]
                        u[c] += wy[q] * wx[p] * value
                        if k == rounds:
                            gx[c] += wy[q] * dx[p] * value
                            gy[c] += dy[q] * wx[p] * value
            if k < rounds:
                x = rest[n, 0] + lean[n, 0] * u[2] - u[0]
                y = rest[n, 1] + lean[n, 1] * u[2] - u[1]
        xx, xy = 1 + gx[0] / step[0], gy[0] / step[1]
        yx, yy = gx[1] / step[0], 1 + gy[1] / step[1]
        zx, zy = gx[2] / step[0], gy[2] / step[1]
        det = xx * yy - xy * yx
        slopes[n, 0] = (zx * yy - zy * yx) / det
        slopes[n, 1] = (zy * xx - zx * xy) / det
        at[n, 0], at[n, 1], at[n, 2] = x + u[0], y + u[1], u[2]
