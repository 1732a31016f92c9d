"""The ray of each pixel within the gel, computed once per camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
_PROBE_MM = 0.5


@dataclass(frozen=True, eq=False)
class Sight:
    """Rays of a lattice of pixels: x, y = `rest_mm` (h, w, 2) + `slope` (h, w, 2) z.

    Within the gel a ray is straight, so that this form is exact. Column i and row j of the lattice
    are the pixels i and j times `pixel_step`.
    """

    rest_mm: Array
    slope: Array
    pixel_step: int

    @classmethod
    def of(cls, camera: VirtualCamera, pixel_step: int = 1) -> Sight:
        """Rays of every `pixel_step`-th pixel; the last ones lie beyond the picture's edge.

        Raises ValueError for pixels that look away from the window, and a step below 1.
        """
        if pixel_step < 1:
            raise ValueError(f"a pixel step of {pixel_step}: must be at least 1")
        columns = -(-(camera.image_width_px - 1) // pixel_step) + 1
        rows = -(-(camera.image_height_px - 1) // pixel_step) + 1
        y, x = np.mgrid[:rows, :columns] * pixel_step
        pixels = np.column_stack([x.ravel(), y.ravel()]).astype(float)
        rest = camera.backproject(pixels, 0.0)[:, :2]
        below = camera.backproject(pixels, -_depth(camera))[:, :2]
        slope = (rest - below) / _depth(camera)
        return cls(rest.reshape(rows, columns, 2), slope.reshape(rows, columns, 2), pixel_step)

    def pixel_mm(self) -> Array:
        """Size (h, w) of a pixel on the gel in mm: the square root of its area."""
        du = np.gradient(self.rest_mm, axis=1) / self.pixel_step
        dv = np.gradient(self.rest_mm, axis=0) / self.pixel_step
        area: Array = np.sqrt(np.abs(du[..., 0] * dv[..., 1] - du[..., 1] * dv[..., 0]))
        return area


def _depth(camera: VirtualCamera) -> float:
    """A depth below the surface, within the gel."""
    if not camera.layers or camera.layers[-1].thickness_mm <= 0:
        raise ValueError("the camera has no gel layer: its last layer must be the gel")
    return min(_PROBE_MM, camera.layers[-1].thickness_mm / 2)
