"""How evenly and how sharply the camera sees the pad."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.pad_grid import grid_points
from gelslim_optics.camera.rays import air_slopes
from gelslim_optics.camera.refraction import reach_growth, reach_per_slope

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Keystone:
    """Smallest and largest scale over the pad, px/mm: across (along y) and along (along x)."""

    across_px_per_mm: tuple[float, float]
    along_px_per_mm: tuple[float, float]

    @property
    def transverse(self) -> float:
        """Ratio of the largest to the smallest scale across; about Z_far/Z_near."""
        return self.across_px_per_mm[1] / self.across_px_per_mm[0]

    @property
    def longitudinal(self) -> float:
        """Ratio of the largest to the smallest scale along; about (Z_far/Z_near)²."""
        return self.along_px_per_mm[1] / self.along_px_per_mm[0]


def keystone(
    camera: VirtualCamera, x_mm: ArrayLike, y_mm: ArrayLike, z_mm: float = 0.0
) -> Keystone:
    """Scale of the picture over the grid of x and y on the pad, refraction included.

    A step along y is the transverse one (the fold tilts the view in the x-z plane), a step along
    x the longitudinal one. Raises ValueError for a grid that the camera cannot see.
    """
    _, _, points = grid_points(x_mm, y_mm, z_mm)
    along, across = np.linalg.norm(camera.jacobian(points), axis=1).T
    return Keystone(
        (float(across.min()), float(across.max())), (float(along.min()), float(along.max()))
    )


def blur_map(
    camera: VirtualCamera,
    x_mm: ArrayLike,
    y_mm: ArrayLike,
    aperture_mm: float,
    focus_mm: float,
    z_mm: float = 0.0,
) -> Array:
    """Largest blur diameter (len(y), len(x)) in mm on the gel: A |Z - s| / s.

    `aperture_mm` A is the entrance pupil f/N, `focus_mm` the distance s in air at which the lens
    is focused. Flat layers seen aslant are astigmatic: with r(t) the reach at slope t, rays side
    by side meet r/t above the pinhole, rays one above the other dr/dt; Z is the distance along
    the axis of whichever image is less sharp (`blur_on_gel_mm` takes both as seen along the
    normal). Raises ValueError unless aperture and focus are positive.
    """
    if not (aperture_mm > 0 and focus_mm > 0):
        raise ValueError(
            f"an aperture of {aperture_mm} mm focused at {focus_mm} mm: both must be positive"
        )
    x, y, points = grid_points(x_mm, y_mm, z_mm)
    slopes = air_slopes(camera, points)
    steepness = np.hypot(slopes[:, 0], slopes[:, 1])
    heights, indices = camera.stack.crossed_mm(points[:, 2]), camera.stack.indices
    per_height = slopes @ camera.forward[:2] + camera.forward[2]
    distances = [
        seen(steepness, heights, indices) * per_height for seen in (reach_per_slope, reach_growth)
    ]
    off = np.max([np.abs(z - focus_mm) for z in distances], axis=0)
    return np.asarray(aperture_mm * off / focus_mm).reshape(len(y), len(x))
