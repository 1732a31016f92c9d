"""The normal motion of each frame from a depth map made elsewhere, one map per frame."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_core.errors import GelslimError
from gelslim_force.contact.normal_source import NormalReading, pressed_sigma_mm
from gelslim_force.frames.upright import upright
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
_MOST_STEPS = 8
_SETTLED_MM = 1e-6


class DepthMapError(GelslimError, ValueError):
    """Depth maps that cannot be used."""


@dataclass(eq=False)
class DepthMapSource:
    """Depth maps (h, w) registered to the picture, taken in the order of the frames.

    A map holds the height of the surface in the sensor frame, in mm, at each pixel: 0 at rest,
    negative where the gel is pressed in, NaN where unknown.

    Attributes:
        camera: The sensor's camera, as calibrated.
        points_mm: (c, 3) surface nodes at rest.
        maps: The maps, one per frame.
        sigma_mm: Standard deviation of the heights where the gel is pressed in, common to all.
        touched_below_mm: Height below which a node counts as touched; None claims no contact.

    Raises:
        DepthMapError: `sigma_mm` is negative or not finite, or the nodes are no (c, 3) array.
    """

    camera: VirtualCamera
    points_mm: Array
    maps: Iterable[NDArray[np.floating]]
    sigma_mm: float = 0.0
    touched_below_mm: float | None = None
    _left: Iterator[NDArray[np.floating]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        points = np.asarray(self.points_mm, dtype=float)
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise DepthMapError(f"points_mm of shape {points.shape} must be (c, 3) and finite")
        if not (np.isfinite(self.sigma_mm) and self.sigma_mm >= 0):
            raise DepthMapError(f"sigma_mm = {self.sigma_mm} must be finite and at least 0")
        self._left = iter(self.maps)

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> NDArray[np.floating] | None:
        """Return the frame's map; None once all maps are used."""
        return next(self._left, None)

    def motion(
        self, seen: NDArray[np.floating] | None, lateral_mm: Array | None = None
    ) -> NormalReading:
        """Heights at the nodes, where the camera sees them.

        A node without a known height takes that of the nearest node with one.
        Raises DepthMapError for a map of another size than the camera's picture.
        """
        count = len(self.points_mm)
        if seen is None:
            return NormalReading.unknown(count, "there is no depth map for this frame")
        heights = self._heights_at_nodes(np.asarray(seen, dtype=float))
        known = np.isfinite(heights)
        if not known.any():
            return NormalReading.unknown(count, "the depth map has no height at any node")
        _, nearest = cKDTree(self.points_mm[known, :2]).query(self.points_mm[:, :2])
        touched = None
        if self.touched_below_mm is not None:
            touched = known & (heights < self.touched_below_mm)
        problem = ""
        if known.mean() < 0.5:
            problem = f"the depth map has a height at only {known.mean():.0%} of the nodes"
        height = heights[known][nearest]
        sigma = np.where(known, pressed_sigma_mm(height, self.sigma_mm), 0.0)
        return NormalReading(height, sigma, touched, problem=problem)

    def _heights_at_nodes(self, heights: Array) -> Array:
        """(c,) heights; each node is looked up where the camera sees it at its own height."""
        camera = self.camera
        heights = upright(heights, camera)
        expected = (camera.image_height_px, camera.image_width_px)
        if heights.shape != expected:
            raise DepthMapError(
                f"the depth map has shape {heights.shape}, but the camera's picture has "
                f"{expected}: register the map to the picture"
            )
        w = np.zeros(len(self.points_mm))
        for _ in range(_MOST_STEPS):
            at = camera.project(np.column_stack([self.points_mm[:, :2], np.nan_to_num(w)]))
            before, w = w, _bilinear(heights, at)
            if np.nanmax(np.abs(w - before), initial=0.0) < _SETTLED_MM:
                break
        return w


def read_depth_maps(path: str | os.PathLike[str]) -> NDArray[np.floating]:
    """Read the depth maps of a NumPy file.

    Args:
        path: `.npy` file with (frames, h, w), or (h, w) for a single map; heights in mm.

    Returns:
        (frames, h, w), memory-mapped.

    Raises:
        DepthMapError: The file cannot be read or holds something else.
    """
    try:
        maps = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise DepthMapError(
            f"{os.fspath(path)} is not a NumPy array that can be read: {error}"
        ) from error
    if not isinstance(maps, np.ndarray) or maps.dtype.kind != "f" or maps.ndim not in (2, 3):
        raise DepthMapError(
            f"{os.fspath(path)}: depth maps must be floating-point (frames, h, w), heights in mm, "
            f"not {getattr(maps, 'dtype', type(maps).__name__)} {getattr(maps, 'shape', '')}"
        )
    return maps if maps.ndim == 3 else maps[None]


def _bilinear(heights: Array, positions_px: Array) -> Array:
    """(c,) values at positions (c, 2); NaN outside the picture or next to an unknown pixel."""
    rows, columns = heights.shape
    x, y = positions_px.T
    within = (x >= 0) & (y >= 0) & (x <= columns - 1) & (y <= rows - 1)
    x, y = np.where(within, x, 0.0), np.where(within, y, 0.0)
    j, i = np.minimum(x.astype(int), columns - 2), np.minimum(y.astype(int), rows - 2)
    u, v = x - j, y - i
    low = heights[i, j] * (1 - u) + heights[i, j + 1] * u
    high = heights[i + 1, j] * (1 - u) + heights[i + 1, j + 1] * u
    return np.where(within, low * (1 - v) + high * v, np.nan)
