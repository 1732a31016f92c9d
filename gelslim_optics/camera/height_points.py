"""Points of the gel that are seen at pixels, where their heights are known, frame after frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]


def points_at_heights(camera: VirtualCamera, pixels: Array, z_mm: Array) -> Array:
    """Points (n, 3) at heights `z_mm` (n,) on the rays of pixels (n, 2).

    These are `camera.points_along(camera.pixel_slopes(pixels), z_mm)`, to rounding, in one compiled
    loop for a few hundred pixels.

    Raises:
        ValueError: The ray of a pixel does not rise to the window.
    """
    return points_on_rays(camera, pixels, image_points(camera, pixels), z_mm)


def image_points(camera: VirtualCamera, pixels: Array) -> Array:
    """Undistorted image points (n, 2), in focal lengths, of pixels (n, 2)."""
    image = (pixels - camera.principal_px) / camera.focal_px
    return image if camera.lens is None else camera.lens.undistort(image)


def points_on_rays(camera: VirtualCamera, pixels: Array, image: Array, z_mm: Array) -> Array:
    """`points_at_heights` of pixels (n, 2) whose `image_points` (n, 2) are known."""
    from gelslim_optics.camera.height_kernel import points_at

    stack, found = camera.stack, np.empty((len(pixels), 3))
    tops, indices = np.array(stack.tops_mm), np.array(stack.indices)
    if points_at(image, camera.axes, camera.position_mm, tops, indices, z_mm, found):
        # It names the first of these pixels.
        camera.pixel_slopes(pixels)
    return found
