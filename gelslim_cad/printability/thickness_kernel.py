"""Compiled rays through a mesh, for the thickness of its walls. Importing this loads numba."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

PARALLEL = 1e-9
"""Determinant below which a ray counts as parallel to a triangle, for edges in mm."""


@njit(cache=True)
def first_hits(
    starts: Any, directions: Any, corners: Any, middles: Any, radii: Any, longest: float
) -> Any:
    """Distance and triangle of the first hit of each ray by the method of Möller and Trumbore.

    Args:
        starts: Where rays begin (n, 3).
        directions: Unit vectors (n, 3).
        corners: Corners of the triangles (m, 3, 3).
        middles: Centres of spheres around the triangles (m, 3).
        radii: Their radii (m,).
        longest: Farthest distance of interest; hits beyond it are not found.

    Returns:
        Distances (n,), infinite without a hit, and numbers of triangles (n,), -1 without one.
    """
    count = len(starts)
    distances = np.full(count, np.inf)
    hits = np.full(count, -1, np.int64)
    for i in range(count):
        ox, oy, oz = starts[i, 0], starts[i, 1], starts[i, 2]
        dx, dy, dz = directions[i, 0], directions[i, 1], directions[i, 2]
        best = longest
        for k in range(len(corners)):
            mx, my, mz = middles[k, 0] - ox, middles[k, 1] - oy, middles[k, 2] - oz
            along = mx * dx + my * dy + mz * dz
            r = radii[k]
            if along < -r or along > best + r:
                continue
            if mx * mx + my * my + mz * mz - along * along > r * r:
                continue
            ax, ay, az = corners[k, 0, 0], corners[k, 0, 1], corners[k, 0, 2]
            ux, uy, uz = corners[k, 1, 0] - ax, corners[k, 1, 1] - ay, corners[k, 1, 2] - az
            vx, vy, vz = corners[k, 2, 0] - ax, corners[k, 2, 1] - ay, corners[k, 2, 2] - az
            px, py, pz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
            determinant = ux * px + uy * py + uz * pz
            if abs(determinant) < PARALLEL:
                continue
            tx, ty, tz = ox - ax, oy - ay, oz - az
            u = (tx * px + ty * py + tz * pz) / determinant
            if u < 0.0 or u > 1.0:
                continue
            qx, qy, qz = ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux
            v = (dx * qx + dy * qy + dz * qz) / determinant
            if v < 0.0 or u + v > 1.0:
                continue
            t = (vx * qx + vy * qy + vz * qz) / determinant
            if 0.0 < t < best:
                best = t
                distances[i] = t
                hits[i] = k
    return distances, hits
