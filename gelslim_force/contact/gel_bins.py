"""Where the bins of a picture are on the gel."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import binary_erosion, distance_transform_edt
from scipy.spatial import cKDTree

from gelslim_force.contact.patch import ContactPatch
from gelslim_force.contact.patch_shading import Region
from gelslim_force.contact.shading_change import ShadingReference
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_DEPTH_MM = 0.2
"""Depth over which the change of the line of sight is measured."""


class GelBins:
    """The bins of one reference picture on the gel. Fields are (rows, columns).

    Args:
        light: The reference; bins that are not on the gel are taken from its `on_pad`.
        camera: The sensor's camera.
        surface_mm: (c, 2 or 3) surface nodes of the pad; only bins near one of them are on it.

    Attributes:
        x_mm: Where the line of sight meets the rest surface.
        y_mm: Likewise.
        parallax: (rows, columns, 2) displacement of the line of sight per mm of height.
        growth_per_mm: Relative change of lengths per mm of height.
        size_mm: Side of a square with the area of the bin.
        on_pad: Bins on the pad.

    Raises:
        ValueError: The reference has another size than the camera's pictures.
    """

    def __init__(
        self, light: ShadingReference, camera: VirtualCamera, surface_mm: ArrayLike | None
    ) -> None:
        self.x_mm, self.y_mm, self.parallax, self.growth_per_mm = bin_positions(light, camera)
        self.size_mm = bin_sizes(self.x_mm, self.y_mm)
        self.on_pad = light.on_pad
        self.on_pad &= np.isfinite(self.x_mm)
        if surface_mm is not None:
            nodes = np.asarray(surface_mm, dtype=float)
            self.on_pad &= near_surface(self.x_mm, self.y_mm, nodes)
        self._last: tuple[Array, tuple[int, int]] | None = None

    @cached_property
    def inner(self) -> Mask:
        """Bins on the pad and not at its edge."""
        return np.asarray(binary_erosion(self.on_pad, iterations=2, border_value=0))

    @cached_property
    def tree(self) -> cKDTree:
        """The bins on the pad, for the nearest one of a place."""
        on = self._on
        return cKDTree(np.column_stack([self.x_mm.ravel()[on], self.y_mm.ravel()[on]]))

    def region(self, bins: Mask) -> Region:
        """Middle and size of a region of bins."""
        middle = np.array([self.x_mm[bins].mean(), self.y_mm[bins].mean()])
        return Region(middle, float(np.sqrt((self.size_mm[bins] ** 2).sum() / np.pi)))

    def holds(self, patch: ContactPatch, scale: float = 1.0) -> bool:
        """Whether a disc, with its size times `scale`, is on the pad as a whole."""
        return patch.kind == "disc" and bool(
            self._inside_mm[self._nearest(patch.centre_mm)] > scale * patch.size_mm
        )

    def sight(self, point_mm: Array) -> tuple[Array, float]:
        """Parallax (2,) and growth per mm at a place (2,)."""
        at = self._nearest(point_mm)
        return self.parallax[at].copy(), float(self.growth_per_mm[at])

    def size_at(self, patch: ContactPatch) -> float:
        """Size of the bins around a patch in mm."""
        return float(self.size_mm[self._nearest(patch.centre_mm)])

    @cached_property
    def _on(self) -> NDArray[np.intp]:
        return np.flatnonzero(self.on_pad)

    @cached_property
    def _inside_mm(self) -> Array:
        """Lower bound of the distance of each bin from the nearest one that is not on the pad."""
        steps = distance_transform_edt(np.pad(self.on_pad, 1))[1:-1, 1:-1]
        return np.asarray((steps - 1) * self.size_mm[self.on_pad].min() / np.sqrt(2))

    def _nearest(self, point_mm: Array) -> tuple[int, int]:
        if self._last is None or not np.array_equal(self._last[0], point_mm):
            _, at = self.tree.query(point_mm)
            row, column = divmod(int(self._on[at]), self.x_mm.shape[1])
            self._last = point_mm.copy(), (row, column)
        return self._last[1]


def bin_positions(
    light: ShadingReference, camera: VirtualCamera
) -> tuple[Array, Array, Array, Array]:
    """Where the bins are on the gel.

    Returns x and y (rows, columns) on the rest surface, the parallax (rows, columns, 2) of the line
    of sight per mm of height, and the relative change of lengths per mm of height.

    Raises:
        ValueError: The reference has another size than the camera's pictures.
    """
    pixels = light.centres_px()
    expected = (camera.image_height_px, camera.image_width_px)
    if light.image.shape[:2] != expected:
        raise ValueError(
            f"the reference is {light.image.shape[1]} x {light.image.shape[0]} px, the "
            f"camera's pictures are {expected[1]} x {expected[0]} px: use frames of this camera"
        )
    depth = _DEPTH_MM
    at_rest = camera.backproject(pixels, 0.0)[:, :2]
    below = camera.backproject(pixels, -depth)[:, :2]
    parallax = ((at_rest - below) / depth).reshape(*light.shape, 2)
    x, y = (at_rest[:, k].reshape(light.shape) for k in (0, 1))
    sunk = below.reshape(*light.shape, 2)
    before = bin_sizes(sunk[..., 0], sunk[..., 1])
    growth = (1 - before / bin_sizes(x, y)) / depth
    return x, y, parallax, growth


def bin_sizes(x: Array, y: Array) -> Array:
    """Side (rows, columns) of a square with the area of the bin on the gel."""
    xi, xj = np.gradient(x)
    yi, yj = np.gradient(y)
    return np.sqrt(np.abs(xi * yj - xj * yi))


def near_surface(x: Array, y: Array, surface_mm: Array) -> Mask:
    """Bins (rows, columns) within half a node spacing, along both axes, of a surface node."""
    nodes = surface_mm[:, :2]
    steps = [np.diff(np.unique(np.round(v, 9))).min() for v in nodes.T]
    points = np.column_stack([x.ravel(), y.ravel()]) / steps
    finite = np.isfinite(points).all(axis=1)
    near = np.zeros(len(points), dtype=bool)
    distance, _ = cKDTree(nodes / steps).query(points[finite], p=np.inf)
    near[finite] = distance <= 0.5
    return near.reshape(x.shape)
