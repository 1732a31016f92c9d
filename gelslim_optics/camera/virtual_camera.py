"""The camera as the gel sees it: mirrored at the fold mirror, looking through flat layers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.back_projection import Outside, Surface, backproject
from gelslim_optics.camera.homography import Homography, fit_homography
from gelslim_optics.camera.layer import Layer, LayerStack
from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.rays import air_slopes, as_points, rays_on_axes, slope_derivatives
from gelslim_optics.camera.record import camera_from_record, camera_to_record
from gelslim_optics.camera.view_quality import Keystone, blur_map, keystone

__all__ = ["Layer", "VirtualCamera", "reflect_direction", "reflect_point"]

Vector = NDArray[np.float64]


def reflect_point(point_mm: ArrayLike, mirror_point_mm: ArrayLike, normal: ArrayLike) -> Vector:
    """Mirror image of a point (3,) in the plane through `mirror_point_mm` with unit normal (3,)."""
    p, q, n = (np.asarray(v, dtype=float) for v in (point_mm, mirror_point_mm, normal))
    return p - 2 * ((p - q) @ n) * n


def reflect_direction(direction: ArrayLike, normal: ArrayLike) -> Vector:
    """Mirror image of a direction (3,)."""
    a, n = np.asarray(direction, dtype=float), np.asarray(normal, dtype=float)
    return a - 2 * (a @ n) * n


@dataclass(frozen=True)
class VirtualCamera:
    """Pinhole behind flat layers, in the sensor frame; image axes in the OpenCV sense.

    `position_mm` (3,) is the pinhole's mirror image below the window; `right`, `down` and
    `forward` (3,) are the mirrored camera axes (left-handed: the fold flips the image); `lens`
    is the real lens' distortion, none for an ideal one.
    Raises ValueError for values that make no camera.
    """

    position_mm: Vector
    right: Vector
    down: Vector
    forward: Vector
    focal_px: float
    image_width_px: int
    image_height_px: int
    window_bottom_z_mm: float
    layers: tuple[Layer, ...]
    lens: LensDistortion | None = None
    principal_offset_px: tuple[float, float] = (0.0, 0.0)
    """Where the axis meets the image, from the image's middle: a real lens sits off centre."""

    def __post_init__(self) -> None:
        for name in ("position_mm", "right", "down", "forward"):
            value = np.array(getattr(self, name), dtype=float)
            if value.shape != (3,) or not np.isfinite(value).all():
                raise ValueError(f"the camera's {name} must be three finite numbers, not {value}")
            object.__setattr__(self, name, value)
        axes = np.array([self.right, self.down, self.forward])
        if np.abs(axes @ axes.T - np.eye(3)).max() > 1e-6:
            raise ValueError("right, down and forward must be unit vectors at right angles")
        for name in ("focal_px", "image_width_px", "image_height_px"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"the camera's {name} = {getattr(self, name)} must be positive")
        offset = tuple(float(v) for v in self.principal_offset_px)
        if len(offset) != 2 or not np.isfinite(offset).all():
            raise ValueError(f"principal_offset_px = {offset} must be two finite numbers")
        object.__setattr__(self, "principal_offset_px", offset)
        if not (np.isfinite(self.air_height_mm) and self.air_height_mm > 0):
            raise ValueError(
                f"the virtual pinhole at z = {self.position_mm[2]:g} mm must lie below the "
                f"window's lower face at {self.window_bottom_z_mm:g} mm"
            )

    @classmethod
    def from_fold(
        cls,
        *,
        camera_mm: ArrayLike,
        pitch_rad: float,
        mirror_point_mm: ArrayLike,
        mirror_angle_rad: float,
        focal_px: float,
        image_width_px: int,
        image_height_px: int,
        window_bottom_z_mm: float,
        layers: tuple[Layer, ...],
        lens: LensDistortion | None = None,
    ) -> VirtualCamera:
        """Fold a camera that looks along +x, pitched down by `pitch_rad`, at a mirror.

        The mirror plane rises towards the tip at `mirror_angle_rad` to the gel plane. The camera
        stands on its head, so that the near edge of the gel is at the top of the image.
        """
        sin_a, cos_a = np.sin(mirror_angle_rad), np.cos(mirror_angle_rad)
        normal = np.array([-sin_a, 0.0, cos_a])
        forward = np.array([np.cos(pitch_rad), 0.0, -np.sin(pitch_rad)])
        down = np.array([np.sin(pitch_rad), 0.0, np.cos(pitch_rad)])
        right = np.cross(down, forward)
        return cls(
            position_mm=reflect_point(camera_mm, mirror_point_mm, normal),
            right=reflect_direction(right, normal),
            down=reflect_direction(down, normal),
            forward=reflect_direction(forward, normal),
            focal_px=focal_px,
            image_width_px=image_width_px,
            image_height_px=image_height_px,
            window_bottom_z_mm=window_bottom_z_mm,
            layers=layers,
            lens=lens,
        )

    @property
    def air_height_mm(self) -> float:
        """Height of the air between virtual pinhole and window."""
        return float(self.window_bottom_z_mm - self.position_mm[2])

    @cached_property
    def axes(self) -> Vector:
        """Right, down and forward as rows (3, 3)."""
        return np.array([self.right, self.down, self.forward])

    @property
    def principal_px(self) -> Vector:
        """Where the axis meets the image (2,), pixel centres at integers."""
        middle = np.array([(self.image_width_px - 1) / 2, (self.image_height_px - 1) / 2])
        return middle + self.principal_offset_px

    @cached_property
    def stack(self) -> LayerStack:
        """The media above the virtual pinhole, air first."""
        return LayerStack.above(float(self.position_mm[2]), self.window_bottom_z_mm, self.layers)

    def air_directions(self, points_mm: ArrayLike) -> Vector:
        """Unit directions (n, 3), in air, of the rays that end at `points_mm` (n, 3).

        Raises ValueError for points not above the virtual pinhole.
        """
        points = as_points(points_mm)
        directions = np.column_stack([air_slopes(self, points), np.ones(len(points))])
        unit: Vector = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return unit

    def project(self, points_mm: ArrayLike) -> Vector:
        """Image positions (n, 2) in px of points (n, 3) in or on the gel, exactly refracted.

        Pixel centres are at integer coordinates; the axis meets the middle of the image. Points
        outside the picture have positions too; points that are not finite have NaN.
        Raises ValueError for points behind the camera or beyond the lens distortion's domain.
        """
        image = self._undistorted(rays_on_axes(self, as_points(points_mm)))
        if self.lens is not None:
            image = self.lens.distort(image)
        pixels: Vector = self.focal_px * image + self.principal_px
        return pixels

    def backproject(
        self,
        pixels: ArrayLike,
        surface: Surface = 0.0,
        *,
        z_range_mm: tuple[float, float] | None = None,
        outside: Outside = "raise",
    ) -> Vector:
        """Points (n, 3) of a plane z or a height field seen at pixels (n, 2); inverse of `project`.

        See `back_projection.backproject`.
        """
        return backproject(self, pixels, surface, z_range_mm=z_range_mm, outside=outside)

    def apparent_distance_mm(self, points_mm: ArrayLike) -> Vector:
        """Distance (n,) along the axis of the points' images seen from air.

        The layers shorten a length h to h/n for rays near the normal (paraxial).
        """
        points = as_points(points_mm)
        d = self.air_directions(points)
        heights = self.stack.crossed_mm(points[:, 2])
        apparent = sum(h / n for h, n in zip(heights, self.stack.indices, strict=True))
        distance: Vector = apparent / d[:, 2] * (d @ self.forward)
        return distance

    def jacobian(self, points_mm: ArrayLike) -> Vector:
        """Image motion (n, 2, 2) in px/mm per motion of the point along x and y, analytic."""
        return self.jacobian_3d(points_mm)[:, :, :2]

    def jacobian_3d(self, points_mm: ArrayLike) -> Vector:
        """Image motion (n, 2, 3) in px/mm per motion of the point along x, y and z, analytic."""
        planar, change = slope_derivatives(self, as_points(points_mm))
        rays = planar @ self.axes[:, :2].T + self.axes[:, 2]
        moved = np.einsum("ij,njk->nik", self.axes[:, :2], change)
        image = self._undistorted(rays)
        motion = (moved[:, :2] - image[:, :, None] * moved[:, 2:]) / rays[:, 2, None, None]
        if self.lens is not None:
            motion = self.lens.jacobian(image) @ motion
        in_px: Vector = self.focal_px * motion
        return in_px

    def blur_on_gel_mm(self, points_mm: ArrayLike, aperture_mm: float, focus_mm: float) -> Vector:
        """Blur diameter (n,) seen on the gel: A |Z-s| / s for aperture A = f/N focused at s."""
        distance = self.apparent_distance_mm(points_mm)
        blur: Vector = aperture_mm * np.abs(distance - focus_mm) / focus_mm
        return blur

    def blur_map(
        self, x_mm: ArrayLike, y_mm: ArrayLike, aperture_mm: float, focus_mm: float, z_mm: float = 0
    ) -> Vector:
        """Blur diameter (len(y), len(x)) in mm on a grid; see `view_quality.blur_map`."""
        return blur_map(self, x_mm, y_mm, aperture_mm, focus_mm, z_mm)

    def keystone(self, x_mm: ArrayLike, y_mm: ArrayLike, z_mm: float = 0.0) -> Keystone:
        """Range of the picture's scale over a grid on the pad; see `view_quality.keystone`."""
        return keystone(self, x_mm, y_mm, z_mm)

    def homography(self, x_mm: ArrayLike, y_mm: ArrayLike, z_mm: float = 0.0) -> Homography:
        """The plane-to-image homography nearest to `project`, with what it leaves, in px."""
        return fit_homography(self, x_mm, y_mm, z_mm)

    def to_record(self) -> dict[str, object]:
        """Plain values for a file; lengths mm, axes as unit vectors."""
        return camera_to_record(self)

    @classmethod
    def from_record(cls, record: Mapping[str, object]) -> VirtualCamera:
        """Inverse of `to_record`; other keys are ignored. Raises ValueError for a bad record."""
        return cls(**camera_from_record(record))

    def _undistorted(self, rays: Vector) -> Vector:
        """Ideal image (n, 2), in focal lengths, of rays (n, 3) on the camera's axes."""
        behind = rays[:, 2] <= 0
        if behind.any():
            raise ValueError(
                f"{int(behind.sum())} of {len(rays)} points lie behind the camera's image plane "
                "and have no image"
            )
        image: Vector = rays[:, :2] / rays[:, 2:]
        return image
