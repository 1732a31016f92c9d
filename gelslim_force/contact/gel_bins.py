"""Where the bins of a picture lie on the gel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_force.contact.shading_change import ShadingReference
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def gel_places(
    light: ShadingReference, camera: VirtualCamera | None, mm_per_px: float
) -> tuple[Array, Array, Array, Array]:
    """x, y (rows, columns) of the bins on the rest surface, lean (…, 2) and growth per mm."""
    pixels = light.centres_px()
    if camera is None:
        height, width = light.image.shape[:2]
        points = (pixels - [(width - 1) / 2, (height - 1) / 2]) * mm_per_px
        x, y = (points[:, k].reshape(light.shape) for k in (0, 1))
        return x, y, np.zeros((*light.shape, 2)), np.zeros(light.shape)
    expected = (camera.image_height_px, camera.image_width_px)
    if light.image.shape[:2] != expected:
        raise ValueError(
            f"the reference frame is {light.image.shape[1]} x {light.image.shape[0]} px, the "
            f"camera's pictures are {expected[1]} x {expected[0]} px: use frames of this camera"
        )
    depth = 0.2
    at_rest = camera.backproject(pixels, 0.0)[:, :2]
    below = camera.backproject(pixels, -depth)[:, :2]
    lean = ((at_rest - below) / depth).reshape(*light.shape, 2)
    x, y = (at_rest[:, k].reshape(light.shape) for k in (0, 1))
    sunk = below.reshape(*light.shape, 2)
    before = bin_sizes(sunk[..., 0], sunk[..., 1])
    growth = (1 - before / bin_sizes(x, y)) / depth
    return x, y, lean, growth


def bin_sizes(x: Array, y: Array) -> Array:
    """Side (rows, columns) of the square of a bin's area on the gel."""
    xi, xj = np.gradient(x)
    yi, yj = np.gradient(y)
    return np.sqrt(np.abs(xi * yj - xj * yi))


def near_surface(x: Array, y: Array, surface_mm: Array) -> Mask:
    """Bins within half a node spacing, along both axes, of a surface node."""
    nodes = surface_mm[:, :2]
    steps = [np.diff(np.unique(np.round(v, 9))).min() for v in nodes.T]
    places = np.column_stack([x.ravel(), y.ravel()]) / steps
    finite = np.isfinite(places).all(axis=1)
    out = np.zeros(len(places), dtype=bool)
    apart, _ = cKDTree(nodes / steps).query(places[finite], p=np.inf)
    out[finite] = apart <= 0.5
    return out.reshape(x.shape)
