"""The camera as the gel sees it: mirrored at the fold mirror, looking through flat layers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.refraction import ray_slope

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
class Layer:
    """A flat layer above the air: thickness and refractive index, camera side first."""

    thickness_mm: float
    index: float


@dataclass(frozen=True)
class VirtualCamera:
    """Pinhole behind flat layers, in the sensor frame; image axes in the OpenCV sense.

    `position_mm` (3,) is the pinhole's mirror image below the window; `right`, `down` and
    `forward` (3,) are the mirrored camera axes (left-handed: the fold flips the image).
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
        )

    @property
    def air_height_mm(self) -> float:
        """Height of the air between virtual pinhole and window."""
        return float(self.window_bottom_z_mm - self.position_mm[2])

    def air_directions(self, points_mm: Vector) -> Vector:
        """Unit directions (n, 3), in air, of the rays that end at `points_mm` (n, 3)."""
        lateral = points_mm[:, :2] - self.position_mm[:2]
        reach = np.hypot(lateral[:, 0], lateral[:, 1])
        depth = points_mm[:, 2] - self.window_bottom_z_mm
        heights: list[ArrayLike] = [self.air_height_mm]
        indices: list[ArrayLike] = [1.0]
        below = np.zeros(len(points_mm))
        for k, layer in enumerate(self.layers):
            last = k == len(self.layers) - 1
            heights.append(depth - below if last else layer.thickness_mm)
            indices.append(layer.index)
            below = below + layer.thickness_mm
        slope = ray_slope(reach, heights, indices)
        safe = np.where(reach > 0, reach, 1.0)
        planar = lateral * (slope / safe)[:, None]
        directions = np.column_stack([planar, np.ones(len(points_mm))])
        unit: Vector = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return unit

    def project(self, points_mm: ArrayLike) -> Vector:
        """Image positions (n, 2) in px of points (n, 3) in or on the gel, exactly refracted.

        Pixel centres are at integer coordinates; the axis meets the middle of the image.
        """
        points = np.atleast_2d(np.asarray(points_mm, dtype=float))
        d = self.air_directions(points)
        depth = d @ self.forward
        u = self.focal_px * (d @ self.right) / depth + (self.image_width_px - 1) / 2
        v = self.focal_px * (d @ self.down) / depth + (self.image_height_px - 1) / 2
        return np.column_stack([u, v])

    def apparent_distance_mm(self, points_mm: ArrayLike) -> Vector:
        """Distance (n,) along the axis of the points' images seen from air.

        The layers shorten a length h to h/n for rays near the normal (paraxial).
        """
        points = np.atleast_2d(np.asarray(points_mm, dtype=float))
        d = self.air_directions(points)
        height = points[:, 2] - self.window_bottom_z_mm
        apparent = np.full(len(points), self.air_height_mm)
        for k, layer in enumerate(self.layers):
            last = k == len(self.layers) - 1
            apparent += (height if last else layer.thickness_mm) / layer.index
            height = height - layer.thickness_mm
        distance: Vector = apparent / d[:, 2] * (d @ self.forward)
        return distance

    def jacobian(self, points_mm: ArrayLike, step_mm: float = 1e-4) -> Vector:
        """Image motion (n, 2, 2) in px/mm per motion of the point along x and y."""
        points = np.atleast_2d(np.asarray(points_mm, dtype=float))
        columns = []
        for axis in range(2):
            shift = np.zeros(3)
            shift[axis] = step_mm
            columns.append(
                (self.project(points + shift) - self.project(points - shift)) / (2 * step_mm)
            )
        return np.stack(columns, axis=2)

    def blur_on_gel_mm(self, points_mm: ArrayLike, aperture_mm: float, focus_mm: float) -> Vector:
        """Blur diameter (n,) seen on the gel: A |Z-s| / s for aperture A = f/N focused at s."""
        distance = self.apparent_distance_mm(points_mm)
        blur: Vector = aperture_mm * np.abs(distance - focus_mm) / focus_mm
        return blur
