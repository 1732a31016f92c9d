"""Compiled shadows that parts of the gel's surface cast on others. Imported where used (numba)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
TOWARDS = np.array(
    [
        [1, 0], [2, 1], [1, 1], [1, 2], [0, 1], [-1, 2], [-1, 1], [-2, 1],
        [-1, 0], [-2, -1], [-1, -1], [-1, -2], [0, -1], [1, -2], [1, -1], [2, -1],
    ]
)  # fmt: skip
"""Steps (16, 2) along x and y from node to node in which a lattice is searched for what shades."""
LOWEST = 0.05
"""Tangent of the elevation below which light is not told apart; nothing is searched beyond it."""
SMALLEST_MM = 5e-3
"""Differences of height that have no effect."""
MOST = 3.0
"""Limit of the linear change of the light with height."""


@njit(**COMPILED)
def horizons(height: Any, step: Any) -> Any:
    """Horizon (ny, nx, 16) of each node in each direction of `TOWARDS`.

    A horizon is the largest tangent of the elevation at which the surface, which the light meets
    from below, hides its source; it is 0 where none is above `LOWEST`.
    """
    ny, nx = height.shape
    found = np.zeros((ny, nx, TOWARDS.shape[0]))
    highest = height.max()
    for j in range(ny):
        for i in range(nx):
            depth = highest - height[j, i]
            if depth < LOWEST * min(step[0], step[1]):
                continue
            for n in range(TOWARDS.shape[0]):
                a, b = TOWARDS[n, 0], TOWARDS[n, 1]
                length = math.sqrt((a * step[0]) ** 2 + (b * step[1]) ** 2)
                p, q, away = i - a, j - b, length
                while 0 <= p < nx and 0 <= q < ny and LOWEST * away < depth:
                    rise = (height[q, p] - height[j, i]) / away
                    if rise > max(found[q, p, n], LOWEST):
                        found[q, p, n] = rise
                    p, q, away = p - a, q - b, away + length
    return found


@njit(**COMPILED)
def relief_light(
    height: Any,
    origin: Any,
    step: Any,
    fans: Any,
    counts: Any,
    rises: Any,
    sides: Any,
    drifts: Any,
    fall: Any,
    width: Any,
    lower: Any,
    upper: Any,
    out: Any,
) -> None:
    """Write the light (ny, nx, k) of the surface's nodes over that of their slopes alone.

    `fans` (k, py, px, b, 3) are the sums of `LightFans` at places in the middle of equal parts of
    the pad from `lower` to `upper` (2,), of which the first `counts` (k, py, px) are taken,
    `rises` (k, py, px, b) the tangents of the elevation of their bins, `sides` the direction in
    `TOWARDS` from which each comes, and `width` the breadth of a bin in the tangent. A bin is
    hidden by the share of its breadth below the horizon. The light of a bin at height z is
    1 - z (drift + τ·fall) of that at rest: `drifts` (k, py, px, b) is for its share of the light
    at a place, `fall` (ny, nx, k, 2) the gradient of the logarithm of the light at rest.
    """
    ny, nx = height.shape
    horizon = horizons(height, step)
    places_y, places_x = fans.shape[1], fans.shape[2]
    for j in range(ny):
        for i in range(nx):
            for k in range(out.shape[2]):
                out[j, i, k] = 1.0
            z = height[j, i]
            if abs(z) < SMALLEST_MM and not horizon[j, i].any():
                continue
            west, east = max(i - 1, 0), min(i + 1, nx - 1)
            south, north = max(j - 1, 0), min(j + 1, ny - 1)
            slope_x = (height[j, east] - height[j, west]) / ((east - west) * step[0])
            slope_y = (height[north, i] - height[south, i]) / ((north - south) * step[1])
            x = (origin[0] + i * step[0] - lower[0]) / (upper[0] - lower[0]) * places_x - 0.5
            y = (origin[1] + j * step[1] - lower[1]) / (upper[1] - lower[1]) * places_y - 0.5
            x, y = min(max(x, 0.0), places_x - 1.0), min(max(y, 0.0), places_y - 1.0)
            px, py = min(int(x), max(places_x - 2, 0)), min(int(y), max(places_y - 2, 0))
            for k in range(out.shape[2]):
                alone = found = 1e-12
                along, across = z * fall[j, i, k, 0], z * fall[j, i, k, 1]
                for corner in range(4):
                    u, v = corner % 2, corner // 2
                    share = (x - px if u else 1 - x + px) * (y - py if v else 1 - y + py)
                    if share <= 0.0:
                        continue
                    fan, rise = fans[k, py + v, px + u], rises[k, py + v, px + u]
                    side, drift = sides[k, py + v, px + u], drifts[k, py + v, px + u]
                    for b in range(counts[k, py + v, px + u]):
                        whole = fan[b, 0]
                        light = share * (whole - slope_x * fan[b, 1] - slope_y * fan[b, 2])
                        if light <= 0.0:
                            continue
                        alone += light
                        moved = z * drift[b] + (along * fan[b, 1] + across * fan[b, 2]) / whole
                        light *= min(max(1.0 - moved, 0.0), MOST)
                        hidden = horizon[j, i, side[b]]
                        if hidden > 0.0:
                            light *= min(max(0.5 + (rise[b] - hidden) / width, 0.0), 1.0)
                        found += light
                out[j, i, k] = found / alone
