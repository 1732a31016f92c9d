"""The camera's body in the mid-plane: housing and lens barrel about the pinhole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gelslim_cad.dimensions.fold_mirror import Mirror
from gelslim_cad.dimensions.fold_problem import Array, FoldProblem
from gelslim_cad.dimensions.fold_sight import Sight


@dataclass(frozen=True)
class Camera:
    """Pinhole, pitch of the axis, and corners (x, z) of housing and lens barrel; mm."""

    x_mm: Array
    z_mm: Array
    pitch_rad: Array
    corners_mm: list[tuple[Array, Array]]

    @property
    def top_z_mm(self) -> Array:
        """Highest corner."""
        return np.max([z for _, z in self.corners_mm], axis=0)

    @property
    def bottom_z_mm(self) -> Array:
        """Lowest corner."""
        return np.min([z for _, z in self.corners_mm], axis=0)

    @property
    def front_x_mm(self) -> Array:
        """Corner nearest to the tip."""
        return np.max([x for x, _ in self.corners_mm], axis=0)

    @property
    def rear_x_mm(self) -> Array:
        """Corner farthest from the tip."""
        return np.min([x for x, _ in self.corners_mm], axis=0)

    def distance_outside_mm(self, p: FoldProblem, x_mm: Array, z_mm: Array) -> Array:
        """How far a point before or above the camera is outside housing and lens barrel."""
        dx, dz = x_mm - self.x_mm, z_mm - self.z_mm
        c, s = np.cos(self.pitch_rad), np.sin(self.pitch_rad)
        ahead, above = dx * c - dz * s, dx * s + dz * c
        housing = np.maximum(ahead + p.lens_height_mm, above - p.module_height_mm / 2)
        barrel = np.maximum(ahead, above - p.lens_diameter_mm / 2)
        return np.minimum(housing, barrel)


def camera(p: FoldProblem, s: Sight, m: Mirror) -> Camera:
    """The camera where the mirror puts the virtual one."""
    x, z = m.reflected(s.virtual_x_mm, s.virtual_z_mm)
    pitch = np.pi / 2 - 2 * m.angle_rad - s.tilt_rad
    return Camera(x, z, pitch, _corners(p, x, z, pitch))


def _corners(p: FoldProblem, x: Array, z: Array, pitch: Array) -> list[tuple[Array, Array]]:
    """Corners (x, z) of housing and lens barrel; the pinhole lies in the barrel's front face."""
    c, s = np.cos(pitch), np.sin(pitch)
    half, radius = p.module_height_mm / 2, p.lens_diameter_mm / 2
    face, rear = -p.lens_height_mm, -p.lens_height_mm - p.module_depth_mm
    local = [(0 * face, radius), (0 * face, -radius)]
    local += [(a, b) for a in (face, rear) for b in (half, -half)]
    return [(x + a * c + b * s, z - a * s + b * c) for a, b in local]
