"""Shift of a lattice that puts given points (markers) on its nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import IfemError, MeshError


def points_in_plane(
    points_mm: ArrayLike, name: str, error: type[IfemError] = MeshError
) -> NDArray[np.float64]:
    """Coordinates x and y (k, 2) of points (k, 2) or (k, 3).

    Args:
        points_mm: The points.
        name: Their name in messages.
        error: Class of the error for a wrong shape or a value that is not finite.
    """
    points = np.asarray(points_mm, dtype=float)
    if points.ndim != 2 or points.shape[1] not in (2, 3) or len(points) == 0:
        raise error(
            f"{name} has shape {points.shape}: must be (k, 2) or (k, 3), k >= 1", field=name
        )
    if not np.isfinite(points).all():
        raise error(f"{name} holds a value that is not finite: check the positions", field=name)
    return points[:, :2]


def aligned_start(
    points: NDArray[np.float64], start: NDArray[np.float64], pitch: NDArray[np.float64]
) -> tuple[NDArray[np.float64], int, float]:
    """Shift a lattice along each axis separately so that most points fall on its lines.

    Args:
        points: (k, 2) in mm.
        start: (x, y) of a lattice node in mm.
        pitch: (hx, hy) in mm.

    Returns:
        The shifted start (2,) in mm, the number of points on nodes, and the largest distance in
        mm of a point from the nearest lattice line along an axis.
    """
    shifted = start.copy()
    for axis in (0, 1):
        distinct, weights = np.unique(np.round(points[:, axis], 9), return_counts=True)
        offset = (distinct - start[axis]) / pitch[axis]
        gap = offset[None, :] - offset[:, None]
        gap = np.abs(gap - np.rint(gap)) * pitch[axis]
        on_line = ((gap < 1e-6) * weights).sum(axis=1)
        # Prefer most points on lines, then the smallest largest distance, then the smallest shift.
        shift = offset - np.rint(offset)
        best = np.lexsort((np.abs(shift), gap.max(axis=1).round(9), -on_line))[0]
        shifted[axis] += shift[best] * pitch[axis]
    offset = (points - shifted) / pitch
    distance = np.abs(offset - np.rint(offset)) * pitch
    return shifted, int((distance.max(axis=1) < 1e-6).sum()), float(distance.max())
