"""The virtual camera: the camera mirrored at the fold mirror, looking through flat layers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera import rays
from gelslim_optics.camera.back_projection import HeightGrid, Outside, Surface, surface_points
from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.record import COUNTS, MODEL, VECTORS, camera_from_record
from gelslim_optics.camera.refraction import Layer, LayerStack

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
    """A pinhole camera behind flat layers, in the sensor frame; image axes as in OpenCV.

    The fold mirror flips the image, so that `right`, `down` and `forward` are left-handed.

    Attributes:
        position_mm: Mirror image (3,) of the pinhole, below the window.
        right: Unit vector (3,) of the image's rows.
        down: Unit vector (3,) of the image's columns.
        forward: Unit vector (3,) of the optical axis.
        focal_px: Focal length in px.
        image_width_px: Width of the image.
        image_height_px: Height of the image.
        window_bottom_z_mm: Height of the lower face of the first layer.
        layers: The layers, the one next to the camera first.
        lens: Distortion of the lens; None for an ideal lens.
        principal_offset_px: Principal point (2,) relative to the centre of the image.

    Raises:
        ValueError: The values do not describe a camera.
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
                f"the virtual pinhole at z = {self.position_mm[2]:g} mm must be below the "
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
        """The virtual camera of a real one that looks along +x at a fold mirror.

        The camera stands on its head, so that the near edge of the gel is at the top of the image.

        Args:
            camera_mm: Position (3,) of the real pinhole.
            pitch_rad: Angle by which the real camera looks down.
            mirror_point_mm: A point (3,) of the mirror.
            mirror_angle_rad: Angle of the mirror to the gel plane; it rises towards the tip.
            focal_px: Focal length in px.
            image_width_px: Width of the image.
            image_height_px: Height of the image.
            window_bottom_z_mm: Height of the lower face of the first layer.
            layers: The layers, the one next to the camera first.
            lens: Distortion of the lens; None for an ideal lens.

        Returns:
            The virtual camera.

        Raises:
            ValueError: The values do not describe a camera.
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
        """Height of the air between the virtual pinhole and the window."""
        return float(self.window_bottom_z_mm - self.position_mm[2])

    @cached_property
    def axes(self) -> Vector:
        """Right, down and forward as rows (3, 3)."""
        return np.array([self.right, self.down, self.forward])

    @property
    def principal_px(self) -> Vector:
        """Principal point (2,), the centres of pixels at integers."""
        middle = np.array([(self.image_width_px - 1) / 2, (self.image_height_px - 1) / 2])
        return middle + self.principal_offset_px

    @cached_property
    def stack(self) -> LayerStack:
        """The media above the virtual pinhole, air first."""
        return LayerStack.above(float(self.position_mm[2]), self.window_bottom_z_mm, self.layers)

    def air_slopes(self, points_mm: ArrayLike) -> Vector:
        """Slopes dx/dz and dy/dz (n, 2), in air, of the rays to points (n, 3).

        Raises ValueError for points that are not above the virtual pinhole.
        """
        return rays.air_slopes(self.position_mm, self.stack, rays.as_points(points_mm))

    def air_directions(self, points_mm: ArrayLike) -> Vector:
        """Unit vectors (n, 3), in air, of the rays to points (n, 3); raises as `air_slopes`."""
        slopes = self.air_slopes(points_mm)
        directions = np.column_stack([slopes, np.ones(len(slopes))])
        unit: Vector = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return unit

    def points_along(self, slopes: Vector, z_mm: Vector) -> Vector:
        """Points (n, 3) at heights `z_mm` (n,) on the rays with `slopes` (n, 2) in air."""
        return rays.points_along(self.position_mm, self.stack, slopes, z_mm)

    def pixel_slopes(self, pixels: ArrayLike) -> Vector:
        """Slopes dx/dz and dy/dz (n, 2), in air, of the rays of pixels (n, 2).

        Raises ValueError for pixels whose ray does not rise to the window.
        """
        uv = np.atleast_2d(np.asarray(pixels, dtype=float))
        if uv.ndim != 2 or uv.shape[1] != 2:
            raise ValueError(f"pixels have shape {np.shape(pixels)}: give (n, 2), u and v in px")
        xy = (uv - self.principal_px) / self.focal_px
        if self.lens is not None:
            xy = self.lens.undistort(xy)
        x, y, z = self.axes[:2].T @ xy.T + self.forward[:, None]
        missed = z <= 0
        if missed.any():
            first = uv[np.argmax(missed)]
            raise ValueError(
                f"{int(missed.sum())} of {len(uv)} pixels, such as ({first[0]:g}, {first[1]:g}), "
                "look away from the window and see no point of it"
            )
        return np.column_stack([x / z, y / z])

    def project(self, points_mm: ArrayLike) -> Vector:
        """Positions in the image of points in or on the gel, with exact refraction.

        Args:
            points_mm: Points (n, 3).

        Returns:
            Positions (n, 2) in px, the centres of pixels at integers. Points outside the image
            have positions too; points that are not finite give NaN.

        Raises:
            ValueError: A point is behind the camera or outside the domain of the lens distortion.
        """
        image = self._undistorted(
            rays.rays_on_axes(self.position_mm, self.stack, self.axes, rays.as_points(points_mm))
        )
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
        """Points of a surface that are seen at pixels; the inverse of `project`.

        A curved surface is met at the first crossing from the side of the camera. It is found by
        comparing 33 heights and refined to 1e-13 mm.

        Args:
            pixels: Positions (n, 2) in px; NaN gives NaN.
            surface: A height z in mm, a `HeightGrid`, or a function of arrays x and y (n,) that
                returns heights.
            z_range_mm: Lowest and highest height at which a function is searched; by default from
                the back of the gel to one gel thickness above its surface.
            outside: Whether rays that miss the surface raise ValueError or give NaN.

        Returns:
            Points (n, 3) in mm.

        Raises:
            ValueError: A ray misses the surface, or a height is not above the virtual pinhole.
        """
        if z_range_mm is None and callable(surface) and not isinstance(surface, HeightGrid):
            if not self.layers or self.layers[-1].thickness_mm == 0:
                raise ValueError("a camera without a gel layer needs z_range_mm")
            back = self.stack.tops_mm[-2]
            z_range_mm = (back, back + 2 * self.layers[-1].thickness_mm)
        return surface_points(
            self.position_mm,
            self.stack,
            self.pixel_slopes(pixels),
            surface,
            z_range_mm,
            outside,
        )

    def apparent_distances_mm(self, points_mm: ArrayLike) -> Vector:
        """Distances (n, 2) along the axis of the two images of points (n, 3), seen from air.

        The first image is formed by sagittal rays, side by side across the plane of incidence, the
        second by tangential rays, within that plane (Coddington's equations at plane faces).
        """
        points = rays.as_points(points_mm)
        d = self.air_directions(points)
        cos = d[:, 2]
        heights = self.stack.crossed_mm(points[:, 2])
        found = np.zeros((len(points), 2))
        for height, index in zip(heights, self.stack.indices, strict=True):
            inside = np.sqrt(1 - (1 - cos**2) / index**2)
            sagittal = height / (index * inside)
            found += np.column_stack([sagittal, sagittal * (cos / inside) ** 2])
        found *= (d @ self.forward)[:, None]
        return found

    def jacobian(self, points_mm: ArrayLike) -> Vector:
        """Derivative (n, 2, 2) in px/mm of `project` by the point's x and y."""
        return self.jacobian_3d(points_mm)[:, :, :2]

    def jacobian_3d(self, points_mm: ArrayLike) -> Vector:
        """Derivative (n, 2, 3) in px/mm of `project` by the point's x, y and z."""
        planar, change = rays.slope_derivatives(
            self.position_mm, self.stack, rays.as_points(points_mm)
        )
        ray = planar @ self.axes[:, :2].T + self.axes[:, 2]
        ray_change = np.einsum("ij,njk->nik", self.axes[:, :2], change)
        image = self._undistorted(ray)
        motion = (ray_change[:, :2] - image[:, :, None] * ray_change[:, 2:]) / ray[:, 2, None, None]
        if self.lens is not None:
            motion = self.lens.jacobian(image) @ motion
        in_px: Vector = self.focal_px * motion
        return in_px

    def blur_on_gel_mm(self, points_mm: ArrayLike, aperture_mm: float, focus_mm: float) -> Vector:
        """Blur diameter (n,) on the gel, A |Z - s| / s for an aperture A = f/N focused at s.

        It is the disc of the same variance as the ellipse that the two images Z give.
        """
        off = np.abs(self.apparent_distances_mm(points_mm) - focus_mm)
        blur: Vector = aperture_mm * np.sqrt(np.mean(off**2, axis=1)) / focus_mm
        return blur

    def to_record(self) -> dict[str, object]:
        """Plain values for a file; lengths in mm, axes as unit vectors.

        `lens_distortion` and `principal_offset_px` are left out where there are none.
        """
        record: dict[str, object] = {"model": MODEL}
        record |= {name: getattr(self, name).tolist() for name in VECTORS}
        record["focal_px"] = float(self.focal_px)
        record |= {name: getattr(self, name) for name in COUNTS}
        record["window_bottom_z_mm"] = float(self.window_bottom_z_mm)
        record["layers"] = [
            {"thickness_mm": float(v.thickness_mm), "index": float(v.index)} for v in self.layers
        ]
        if self.lens is not None:
            record["lens_distortion"] = self.lens.to_record()
        if any(self.principal_offset_px):
            record["principal_offset_px"] = list(self.principal_offset_px)
        return record

    @classmethod
    def from_record(cls, record: Mapping[str, object]) -> VirtualCamera:
        """The camera of a record made by `to_record`; unknown keys are ignored.

        Raises ValueError for a record of another model or with values that are missing.
        """
        return cls(**camera_from_record(record))

    def _undistorted(self, ray: Vector) -> Vector:
        """Image (n, 2) without distortion, in focal lengths, of rays (n, 3) on the axes."""
        behind = ray[:, 2] <= 0
        if behind.any():
            raise ValueError(
                f"{int(behind.sum())} of {len(ray)} points lie behind the camera's image plane "
                "and have no image"
            )
        image: Vector = ray[:, :2] / ray[:, 2:]
        return image
