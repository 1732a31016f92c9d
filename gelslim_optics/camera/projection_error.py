"""Projection error: the sideways motion that the camera seems to see when a marker moves in z.

A marker at M that moves by d along z is seen where another point of its plane, M + Δ, was seen
before. Signs: d counts along +z, out of the gel and away from the camera, so a press has d < 0;
Δ (mm, along x and y) is the *apparent* motion, to be subtracted from the motion measured on the
plane. With r from the foot of the virtual pinhole to the marker, Δ = -(r/|r|) d tan β: a pressed
marker seems to move away from the foot. (Ma et al., ICRA 2019, "Compensation to projection
error", write Δ = (r/|r|) d tan β with d the depth pressed.)

Models, by the angle α of the ray in air and β of the ray in the gel, sin β = sin α / n_gel:
  printed           α = |r| / |z - z_c|, as in the paper, no arctan
  arctan            tan α = |r| / |z - z_c|, the straight ray that the paper means
  effective_height  tan α = |r| / H, H = h_air + Σ h_i/n_i, the height seen through the layers
  exact             the refracted ray through M + d traced back to the plane of M

The first three take the angle at M, before the motion, so for a press they are low by another
|d|/H.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.pad_grid import grid_points
from gelslim_optics.camera.rays import air_slopes, as_points, points_along

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
ErrorModel = Literal["printed", "arctan", "effective_height", "exact"]
MODELS: tuple[ErrorModel, ...] = get_args(ErrorModel)


def effective_height_mm(camera: VirtualCamera, z_mm: ArrayLike = 0.0) -> Array:
    """Height of the virtual pinhole below points at `z_mm` as seen from air, near the normal.

    H = h_air + Σ h_i/n_i. Raises ValueError for points not above the pinhole.
    """
    z = np.asarray(z_mm, dtype=float)
    if np.any(z <= camera.position_mm[2]):
        raise ValueError(f"z = {np.min(z):g} mm is not above the pinhole")
    stack = camera.stack
    heights = stack.crossed_mm(z)
    return np.asarray(sum(h / n for h, n in zip(heights, stack.indices, strict=True)))


def projection_error_mm(
    camera: VirtualCamera,
    points_mm: ArrayLike,
    displacement_z_mm: ArrayLike,
    model: ErrorModel = "exact",
) -> Array:
    """Apparent motion Δ (n, 2) in mm, along x and y, of points (n, 3) displaced along z.

    `displacement_z_mm` is one value or (n,), negative for a press. See the module for signs and
    models. Raises ValueError for an unknown model, shapes that do not fit, or points that are not
    above the virtual pinhole before and after.
    """
    points = as_points(points_mm)
    d = np.asarray(displacement_z_mm, dtype=float)
    if d.shape not in ((), (len(points),)):
        raise ValueError(
            f"displacements have shape {d.shape}: give one, or one for each of {len(points)} points"
        )
    if model not in MODELS:
        raise ValueError(f"model = {model!r}: the projection error has {', '.join(MODELS)}")
    d = np.broadcast_to(d, len(points))
    if model == "exact":
        moved = points + d[:, None] * [0.0, 0.0, 1.0]
        slopes = air_slopes(camera, moved)
        return points_along(camera, slopes, points[:, 2])[:, :2] - points[:, :2]
    lateral = points[:, :2] - camera.position_mm[:2]
    reach = np.hypot(lateral[:, 0], lateral[:, 1])
    angle = _angle_in_air(camera, reach, points[:, 2], model)
    sine = np.sin(angle) / (camera.layers[-1].index if camera.layers else 1.0)
    away = lateral / np.where(reach > 0, reach, 1.0)[:, None]
    error: Array = -away * (d * sine / np.sqrt(1 - sine * sine))[:, None]
    return error


def _angle_in_air(camera: VirtualCamera, reach: Array, z: Array, model: ErrorModel) -> Array:
    height = z - camera.position_mm[2]
    if not np.all((height > 0) | np.isnan(height)):
        raise ValueError("points must lie above the virtual pinhole")
    if model == "effective_height":
        return np.asarray(np.arctan(reach / effective_height_mm(camera, z)))
    ratio: Array = reach / height
    return ratio if model == "printed" else np.arctan(ratio)


@dataclass(frozen=True)
class ErrorMap:
    """The projection errors of a pad whose markers all move by the same distance along z.

    `delta_mm` gives Δ (len(y), len(x), 2) of each model.
    """

    x_mm: Array
    y_mm: Array
    displacement_z_mm: float
    delta_mm: dict[ErrorModel, Array]

    def relative(self, model: ErrorModel) -> Array:
        """|Δ| of a model over the exact one less 1, (len(y), len(x)); NaN where Δ is zero."""
        size = np.linalg.norm(self.delta_mm[model], axis=2)
        exact = np.linalg.norm(self.delta_mm["exact"], axis=2)
        known = exact > 0
        return np.where(known, size / np.where(known, exact, 1.0) - 1, np.nan)

    def off_mm(self, model: ErrorModel) -> Array:
        """Distance (len(y), len(x)) in mm of a model's Δ from the exact one."""
        return np.asarray(np.linalg.norm(self.delta_mm[model] - self.delta_mm["exact"], axis=2))


def error_map(
    camera: VirtualCamera,
    x_mm: ArrayLike,
    y_mm: ArrayLike,
    displacement_z_mm: float,
    z_mm: float = 0.0,
) -> ErrorMap:
    """Projection errors in every model over the grid of x and y on the pad.

    Raises ValueError for a grid or a displacement that the camera cannot look at.
    """
    x, y, points = grid_points(x_mm, y_mm, z_mm)
    deltas = {
        model: projection_error_mm(camera, points, displacement_z_mm, model).reshape(
            len(y), len(x), 2
        )
        for model in MODELS
    }
    return ErrorMap(x, y, float(displacement_z_mm), deltas)
