"""The surface of the pad in the picture: where arrows start and which pixels a node colours."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import Delaunay, QhullError

Array = NDArray[np.float64]
Projection = Callable[[Array], Array]
"""From points (n, 3) in mm to positions (n, 2) in px, such as `VirtualCamera.project`."""
_COARSE = 4
_STEP_MM = 0.05


class SurfaceView:
    """Nodes in the picture: averaged in cells for arrows, interpolated to pixels for shades.

    The camera's projection is evaluated once, so that a frame needs only a few matrix products.
    """

    def __init__(
        self, points_mm: Array, project: Projection, shape: tuple[int, int], cell_mm: float
    ) -> None:
        """Project the nodes into a picture of `shape` (h, w); one arrow per cell of `cell_mm`."""
        self.points_mm = points_mm
        self._project = project
        self.shape = shape
        self._gather, centres = _cells(points_mm, cell_mm)
        self.cells_px = project(centres)
        """(k, 2) positions at which the arrows start."""
        steps = [np.array([_STEP_MM, 0, 0]), np.array([0, _STEP_MM, 0])]
        columns = [(project(centres + s) - project(centres - s)) / (2 * _STEP_MM) for s in steps]
        self.px_per_mm = np.stack(columns, axis=-1)
        """(k, 2, 2) Jacobian of the projection along the gel at each cell."""
        self._spread = _spreading(project(points_mm), shape)

    def arrows_px(self, traction_mpa: Array, mm_per_mpa: float) -> Array:
        """Return the arrows (k, 2) of the mean tangential traction in each cell."""
        mean = self._gather @ traction_mpa[:, :2]
        return np.einsum("kij,kj->ki", self.px_per_mm, mean * mm_per_mpa)

    def spread(self, values: Array) -> Array:
        """Interpolate values (c,) at the nodes linearly to a picture (h, w), 0 outside the pad."""
        height, width = _coarse(self.shape)
        coarse = (self._spread @ values).reshape(height, width)
        return _enlarged(coarse, self.shape)

    def position_px(self, point_mm: Array) -> Array:
        """Return the position (2,) of a point (2,) on the surface; NaN for NaN."""
        if not np.isfinite(point_mm).all():
            return np.full(2, np.nan)
        return np.asarray(self._project(np.array([[point_mm[0], point_mm[1], 0.0]]))[0])


def _cells(points_mm: Array, cell_mm: float) -> tuple[sparse.csr_array, Array]:
    """Matrix (k, c) that averages over the nodes of a cell, and the centroids (k, 3)."""
    box = np.floor(points_mm[:, :2] / cell_mm + 0.5).astype(np.int64)
    _, cell = np.unique(box, axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    share = 1.0 / np.bincount(cell)[cell]
    gather = sparse.csr_array((share, (cell, np.arange(len(cell)))))
    return gather, np.asarray(gather @ points_mm)


def _coarse(shape: tuple[int, int]) -> tuple[int, int]:
    return -(-shape[0] // _COARSE), -(-shape[1] // _COARSE)


def _spreading(nodes_px: Array, shape: tuple[int, int]) -> sparse.csr_array:
    """Barycentric weights (coarse pixels, c) of the nodes' triangles in the picture."""
    height, width = _coarse(shape)
    rows, columns = np.mgrid[:height, :width]
    middle = (_COARSE - 1) / 2
    pixels = np.column_stack([columns.ravel(), rows.ravel()]) * _COARSE + middle
    size = (height * width, len(nodes_px))
    try:
        net = Delaunay(nodes_px)
    except (QhullError, ValueError):  # too few nodes, or all on one line: there is no area
        return sparse.csr_array(size)
    triangle = net.find_simplex(pixels)
    inside = np.flatnonzero(triangle >= 0)
    frame = net.transform[triangle[inside]]
    two = np.einsum("kij,kj->ki", frame[:, :2], pixels[inside] - frame[:, 2])
    weights = np.column_stack([two, 1 - two.sum(axis=1)])
    corners = net.simplices[triangle[inside]]
    return sparse.csr_array((weights.ravel(), (np.repeat(inside, 3), corners.ravel())), shape=size)


def _enlarged(coarse: Array, shape: tuple[int, int]) -> Array:
    """Interpolate linearly between coarse pixels, whose centres are at i + 1/2."""
    for axis, count in enumerate(shape):
        at = np.clip((np.arange(count) + 0.5) / _COARSE - 0.5, 0, coarse.shape[axis] - 1)
        low = np.minimum(at.astype(int), max(coarse.shape[axis] - 2, 0))
        high = np.minimum(low + 1, coarse.shape[axis] - 1)
        part = (at - low).reshape((-1, 1) if axis == 0 else (1, -1))
        coarse = coarse.take(low, axis) * (1 - part) + coarse.take(high, axis) * part
    return coarse
