"""A rectangular grid of points on the gel."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def pad_axes(length_mm: float, width_mm: float, pitch_mm: float = 0.5) -> tuple[Array, Array]:
    """Coordinates x and y of a centred grid that reaches a pad's edges.

    The pitch is shortened to fit. Raises ValueError for sizes that are not positive.
    """
    if not (length_mm > 0 and width_mm > 0 and pitch_mm > 0):
        raise ValueError(
            f"a pad of {length_mm} x {width_mm} mm with a grid pitch of {pitch_mm} mm: "
            "all three must be positive"
        )
    x, y = (
        np.linspace(-size / 2, size / 2, max(1, int(np.ceil(size / pitch_mm - 1e-9))) + 1)
        for size in (length_mm, width_mm)
    )
    return x, y


def grid_points(x_mm: ArrayLike, y_mm: ArrayLike, z_mm: float = 0.0) -> tuple[Array, Array, Array]:
    """Axes x, y and the grid's points (len(y) len(x), 3) at height z, x running fastest.

    Raises ValueError for axes that are not one-dimensional and finite.
    """
    x, y = (np.atleast_1d(np.asarray(a, dtype=float)) for a in (x_mm, y_mm))
    if x.ndim != 1 or y.ndim != 1 or not len(x) or not len(y):
        raise ValueError(f"grid axes of shape {x.shape} and {y.shape}: give two rows of values")
    if not (np.isfinite(x).all() and np.isfinite(y).all() and np.isfinite(z_mm)):
        raise ValueError("grid axes and height must be finite")
    across, along = np.meshgrid(y, x, indexing="ij")
    points = np.column_stack([along.ravel(), across.ravel(), np.full(along.size, float(z_mm))])
    return x, y, points
