"""Compiled rays through a mesh, for the thickness of its walls. Importing this loads numba."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

PARALLEL = 1e-9
"""Determinant below which a ray counts as parallel to a triangle, for edges in mm."""
Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


def first_hits(
    starts: Floats, directions: Floats, corners: Floats, longest: float
) -> tuple[Floats, Indices]:
    """Distance and triangle of the first hit of each ray.

    Space is divided into cubes as wide as the longest ray, so that each ray meets only the
    triangles of a few cubes.

    Args:
        starts: Where rays begin (n, 3).
        directions: Unit vectors (n, 3).
        corners: Corners of the triangles (m, 3, 3).
        longest: Farthest distance of interest; hits beyond it are not found.

    Returns:
        Distances (n,), infinite without a hit, and numbers of triangles (n,), -1 without one.
    """
    low = corners.min(axis=(0, 1))
    shape = np.floor((corners.max(axis=(0, 1)) - low) / longest).astype(np.int64) + 1
    ends, members = _by_cube(corners, low, shape, longest)
    distances, hits = _search(starts, directions, corners, low, shape, longest, ends, members)
    return distances, hits


def _by_cube(corners: Floats, low: Floats, shape: Indices, width: float) -> tuple[Indices, Indices]:
    """Triangles by cube: where each cube's list ends, after a zero, and the lists in a row."""
    first = np.floor((corners.min(axis=1) - low) / width).astype(np.int64)
    last = np.floor((corners.max(axis=1) - low) / width).astype(np.int64)
    spans = last - first + 1
    counts = spans.prod(axis=1)
    triangles = np.repeat(np.arange(len(corners)), counts)
    place = np.arange(len(triangles)) - np.repeat(np.cumsum(counts) - counts, counts)
    span = spans[triangles]
    steps = np.column_stack(
        [place // (span[:, 1] * span[:, 2]), place // span[:, 2] % span[:, 1], place % span[:, 2]]
    )
    cubes = np.ravel_multi_index((first[triangles] + steps).T, shape)
    order = np.argsort(cubes, kind="stable")
    filled = np.bincount(cubes, minlength=int(shape.prod()))
    return np.concatenate([[0], np.cumsum(filled)]), triangles[order]


@njit(cache=True)
def _search(
    starts: Any,
    directions: Any,
    corners: Any,
    low: Any,
    shape: Any,
    longest: float,
    ends: Any,
    members: Any,
) -> Any:
    """As `first_hits`, in the cubes that the box around a ray meets."""
    count = len(starts)
    distances = np.full(count, np.inf)
    hits = np.full(count, -1, np.int64)
    begin = np.empty(3, np.int64)
    stop = np.empty(3, np.int64)
    for i in range(count):
        for axis in range(3):
            a = starts[i, axis] - low[axis]
            b = a + longest * directions[i, axis]
            begin[axis] = max(0, int(np.floor(min(a, b) / longest)))
            stop[axis] = min(shape[axis], int(np.floor(max(a, b) / longest)) + 1)
        best = longest
        for cx in range(begin[0], stop[0]):
            for cy in range(begin[1], stop[1]):
                for cz in range(begin[2], stop[2]):
                    cube = (cx * shape[1] + cy) * shape[2] + cz
                    for n in range(ends[cube], ends[cube + 1]):
                        k = members[n]
                        t = _distance(starts[i], directions[i], corners[k])
                        # Of triangles that are hit at the same distance the first counts.
                        if t < best or (t == best and k < hits[i]):
                            best = t
                            distances[i] = t
                            hits[i] = k
    return distances, hits


@njit(cache=True)
def _distance(start: Any, direction: Any, triangle: Any) -> float:
    """Distance along a ray to a triangle by the method of Möller and Trumbore, or infinity."""
    dx, dy, dz = direction[0], direction[1], direction[2]
    ax, ay, az = triangle[0, 0], triangle[0, 1], triangle[0, 2]
    ux, uy, uz = triangle[1, 0] - ax, triangle[1, 1] - ay, triangle[1, 2] - az
    vx, vy, vz = triangle[2, 0] - ax, triangle[2, 1] - ay, triangle[2, 2] - az
    px, py, pz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
    determinant = ux * px + uy * py + uz * pz
    if abs(determinant) < PARALLEL:
        return np.inf
    tx, ty, tz = start[0] - ax, start[1] - ay, start[2] - az
    u = (tx * px + ty * py + tz * pz) / determinant
    if u < 0.0 or u > 1.0:
        return np.inf
    qx, qy, qz = ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux
    v = (dx * qx + dy * qy + dz * qz) / determinant
    if v < 0.0 or u + v > 1.0:
        return np.inf
    t = (vx * qx + vy * qy + vz * qz) / determinant
    return t if t > 0.0 else np.inf
