"""Projection error: the apparent lateral motion of a marker that moves along z.

A marker at M that moves by d along z is seen where another point of its plane, M + Δ, was seen
before. Signs: d is positive along +z, out of the gel and away from the camera, so that a press has
d < 0; Δ (mm, along x and y) is the apparent motion, to be subtracted from the motion measured in
the plane. With r from the foot of the virtual pinhole to the marker, Δ = -(r/|r|) d tan β: a
pressed marker seems to move away from the foot. (Ma et al., ICRA 2019, "Compensation to projection
error", write Δ = (r/|r|) d tan β with d the depth of the press.)

Models, by the angle α of the ray in air and β of the ray in the gel, sin β = sin α / n_gel:
  printed           α = |r| / |z - z_c|, as printed in the paper, without arctan
  arctan            tan α = |r| / |z - z_c|, the straight ray
  effective_height  tan α = |r| / H, H = h_air + Σ h_i/n_i, the apparent height through the layers
  exact             the refracted ray through M + d, traced back to the plane of M

The first three use the angle at M before the motion, so that for a press they are too small by
another |d|/H.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.rays import as_points, check_above
from gelslim_optics.camera.view_quality import grid_points
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
ErrorModel = Literal["printed", "arctan", "effective_height", "exact"]
MODELS: tuple[ErrorModel, ...] = get_args(ErrorModel)


def effective_height_mm(camera: VirtualCamera, z_mm: ArrayLike = 0.0) -> Array:
    """Apparent height H = h_air + Σ h_i/n_i of points at `z_mm` above the pinhole (paraxial).

    Raises ValueError for points that are not above the pinhole.
    """
    z = np.asarray(z_mm, dtype=float)
    check_above(camera.position_mm, z)
    stack = camera.stack
    heights = stack.crossed_mm(z)
    return np.asarray(sum(h / n for h, n in zip(heights, stack.indices, strict=True)))


def projection_error_mm(
    camera: VirtualCamera,
    points_mm: ArrayLike,
    displacement_z_mm: ArrayLike,
    model: ErrorModel = "exact",
) -> Array:
    """Apparent lateral motion of points that are displaced along z.

    Args:
        camera: The camera.
        points_mm: Points (n, 3) before the displacement.
        displacement_z_mm: One value or (n,), negative for a press.
        model: See the module.

    Returns:
        Δ (n, 2) in mm along x and y.

    Raises:
        ValueError: The model is unknown, the shapes do not fit, or a point is not above the
            virtual pinhole before and after the displacement.
    """
    points = as_points(points_mm)
    d = np.asarray(displacement_z_mm, dtype=float)
    if d.shape not in ((), (len(points),)):
        raise ValueError(
            f"displacements have shape {d.shape}: give one value, or one per point ({len(points)},)"
        )
    if model not in MODELS:
        raise ValueError(f"model = {model!r} must be one of {', '.join(MODELS)}")
    d = np.broadcast_to(d, len(points))
    if model == "exact":
        moved = points + d[:, None] * [0.0, 0.0, 1.0]
        slopes = camera.air_slopes(moved)
        return camera.points_along(slopes, points[:, 2])[:, :2] - points[:, :2]
    lateral = points[:, :2] - camera.position_mm[:2]
    reach = np.hypot(lateral[:, 0], lateral[:, 1])
    angle = _angle_in_air(camera, reach, points[:, 2], model)
    sine = np.sin(angle) / (camera.layers[-1].index if camera.layers else 1.0)
    outward = lateral / np.where(reach > 0, reach, 1.0)[:, None]
    error: Array = -outward * (d * sine / np.sqrt(1 - sine * sine))[:, None]
    return error


def _angle_in_air(camera: VirtualCamera, reach: Array, z: Array, model: ErrorModel) -> Array:
    check_above(camera.position_mm, z)
    if model == "effective_height":
        return np.asarray(np.arctan(reach / effective_height_mm(camera, z)))
    ratio: Array = reach / (z - camera.position_mm[2])
    return ratio if model == "printed" else np.arctan(ratio)


@dataclass(frozen=True)
class ErrorMap:
    """Projection errors of a pad whose markers all move by the same distance along z.

    `delta_mm` holds Δ (ny, nx, 2) in mm for each model.
    """

    x_mm: Array
    y_mm: Array
    displacement_z_mm: float
    delta_mm: dict[ErrorModel, Array]

    def relative(self, model: ErrorModel) -> Array:
        """Relative error (ny, nx) of the size |Δ| of a model; NaN where the exact Δ is zero."""
        size = np.linalg.norm(self.delta_mm[model], axis=2)
        exact = np.linalg.norm(self.delta_mm["exact"], axis=2)
        known = exact > 0
        return np.where(known, size / np.where(known, exact, 1.0) - 1, np.nan)

    def deviation_mm(self, model: ErrorModel) -> Array:
        """Distance (ny, nx) in mm of the Δ of a model from the exact one."""
        return np.asarray(np.linalg.norm(self.delta_mm[model] - self.delta_mm["exact"], axis=2))


def error_map(
    camera: VirtualCamera,
    x_mm: ArrayLike,
    y_mm: ArrayLike,
    displacement_z_mm: float,
    z_mm: float = 0.0,
) -> ErrorMap:
    """Projection errors of every model on the grid of x (nx,) and y (ny,) at height `z_mm`.

    Raises ValueError for points that are not above the virtual pinhole.
    """
    x, y, points = grid_points(x_mm, y_mm, z_mm)
    deltas = {
        model: projection_error_mm(camera, points, displacement_z_mm, model).reshape(
            len(y), len(x), 2
        )
        for model in MODELS
    }
    return ErrorMap(x, y, float(displacement_z_mm), deltas)
