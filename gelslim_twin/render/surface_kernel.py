"""Compiled cubic interpolation of the gel's displacement. Imported where used (numba)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

BEYOND_CELLS = 5
"""A ray sees a level surface where its way from the middle, in half cells, is above the number of
nodes and this."""
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
def _here(padded: Any, j: Any, i: Any, wy: Any, wx: Any) -> Any:
    """Displacement at weights `wy`, `wx` (4,) of the nodes about cell j, i."""
    a = b = c = 0.0
    for q in range(4):
        row = padded[j + q]
        e = f = g = 0.0
        for p in range(4):
            e += wx[p] * row[i + p, 0]
            f += wx[p] * row[i + p, 1]
            g += wx[p] * row[i + p, 2]
        a += wy[q] * e
        b += wy[q] * f
        c += wy[q] * g
    return a, b, c


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
        out[n, 0], out[n, 1], out[n, 2] = _here(padded, j, i, wy, wx)


@njit(**COMPILED)
def seen_slopes(
    padded: Any,
    origin: Any,
    step: Any,
    rest: Any,
    lean: Any,
    rounds: Any,
    near: Any,
    slopes: Any,
    met: Any,
) -> None:
    """Write the slopes (n, 2) of the deformed surface and its points `met` (n, 2) that rays meet.

    A ray is at rest (n, 2) + lean (n, 2) z. The material point X with X + u(X) on the ray is
    found by X = rest + lean u_z(X) - u_xy(X), `rounds` times or until it moves less than `near`.
    The slope of the surface carried along is (I + du_xy/dX)^-T du_z/dX; rays that meet the rest
    plane three cells beyond the grid are taken to see a level surface.
    """
    ny, nx = padded.shape[0] - 2, padded.shape[1] - 2
    wx, wy, dx, dy = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    for n in range(rest.shape[0]):
        x, y = rest[n, 0], rest[n, 1]
        if (
            abs(2 * (x - origin[0]) / step[0] - nx + 1) > nx + BEYOND_CELLS
            or abs(2 * (y - origin[1]) / step[1] - ny + 1) > ny + BEYOND_CELLS
        ):
            slopes[n, 0] = slopes[n, 1] = 0.0
            met[n, 0], met[n, 1] = x, y
            continue
        i, s = cell_of((x - origin[0]) / step[0], nx)
        j, t = cell_of((y - origin[1]) / step[1], ny)
        weights(s, wx, dx)
        weights(t, wy, dy)
        for _ in range(rounds):
            a, b, c = _here(padded, j, i, wy, wx)
            moved_x, moved_y = rest[n, 0] + lean[n, 0] * c - a, rest[n, 1] + lean[n, 1] * c - b
            left = abs(moved_x - x) + abs(moved_y - y)
            x, y = moved_x, moved_y
            i, s = cell_of((x - origin[0]) / step[0], nx)
            j, t = cell_of((y - origin[1]) / step[1], ny)
            weights(s, wx, dx)
            weights(t, wy, dy)
            if left < near:
                break
        met[n, 0], met[n, 1] = x, y
        xx, yx, zx = _here(padded, j, i, wy, dx)
        xy, yy, zy = _here(padded, j, i, dy, wx)
        xx, yx, zx = 1 + xx / step[0], yx / step[0], zx / step[0]
        xy, yy, zy = xy / step[1], 1 + yy / step[1], zy / step[1]
        det = xx * yy - xy * yx
        slopes[n, 0] = (zx * yy - zy * yx) / det
        slopes[n, 1] = (zy * xx - zx * xy) / det


@njit(**COMPILED)
def fan_light(
    slopes: Any,
    rest: Any,
    tables: Any,
    lower: Any,
    upper: Any,
    steepest: Any,
    ambient: Any,
    out: Any,
) -> None:
    """Write light (n, k) float32 over that of a level surface, at slopes (n, 2).

    `tables` (k, py, px, m, m) hold it, times the length of the normal (-slope, 1), at places in the
    middle of equal parts of the pad from `lower` to `upper` (2,), by slope along y and x from
    -`steepest` to `steepest`; both are interpolated linearly. The share `ambient` is blind to the
    slope.
    """
    places_y, places_x, count = tables.shape[1], tables.shape[2], tables.shape[3]
    for n in range(slopes.shape[0]):
        x = (rest[n, 0] - lower[0]) / (upper[0] - lower[0]) * places_x - 0.5
        y = (rest[n, 1] - lower[1]) / (upper[1] - lower[1]) * places_y - 0.5
        i, u = _part(x, places_x)
        j, v = _part(y, places_y)
        a, s = _part((slopes[n, 0] / steepest + 1.0) * (count - 1) / 2, count)
        b, t = _part((slopes[n, 1] / steepest + 1.0) * (count - 1) / 2, count)
        size = math.sqrt(1.0 + slopes[n, 0] ** 2 + slopes[n, 1] ** 2)
        for k in range(tables.shape[0]):
            light = 0.0
            for q in range(2):
                for p in range(2):
                    share = (v if q else 1.0 - v) * (u if p else 1.0 - u)
                    if share == 0.0:
                        continue
                    table = tables[k, j + q, i + p]
                    low = (1.0 - s) * table[b, a] + s * table[b, a + 1]
                    high = (1.0 - s) * table[b + 1, a] + s * table[b + 1, a + 1]
                    light += share * ((1.0 - t) * low + t * high)
            light /= size
            out[n, k] = light + ambient * (1.0 - light)


@njit(**COMPILED)
def apply_relief(met: Any, factor: Any, origin: Any, step: Any, light: Any) -> None:
    """Multiply light (n, k) by `factor` (ny, nx, k) at points `met` (n, 2), bilinear.

    The factor is on a lattice of nodes from `origin` in steps of `step` (2,).
    """
    ny, nx = factor.shape[0], factor.shape[1]
    for n in range(met.shape[0]):
        i, u = _part((met[n, 0] - origin[0]) / step[0], nx)
        j, v = _part((met[n, 1] - origin[1]) / step[1], ny)
        for k in range(light.shape[1]):
            low = (1.0 - u) * factor[j, i, k] + u * factor[j, i + 1, k]
            high = (1.0 - u) * factor[j + 1, i, k] + u * factor[j + 1, i + 1, k]
            light[n, k] *= (1.0 - v) * low + v * high


@njit(**COMPILED)
def _part(at: Any, count: Any) -> Any:
    """Number of the value before a coordinate held to `count` values, and the part beyond it."""
    held = min(max(at, 0.0), count - 1.0)
    i = min(math.floor(held), max(count - 2, 0))
    return i, held - i
