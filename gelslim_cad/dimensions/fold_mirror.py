"""The mirror that folds the view: as high below the window and as long as the view needs it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gelslim_cad.dimensions.fold_problem import Array, FoldProblem
from gelslim_cad.dimensions.fold_sight import Sight


@dataclass(frozen=True)
class Mirror:
    """The part of the mirror that the view meets; lengths mm."""

    angle_rad: Array
    upper_x_mm: Array
    upper_z_mm: Array
    lower_x_mm: Array
    lower_z_mm: Array
    length_mm: Array
    half_width_mm: Array

    @property
    def cos(self) -> Array:
        """Cosine of the angle."""
        return np.cos(self.angle_rad)

    @property
    def sin(self) -> Array:
        """Sine of the angle."""
        return np.sin(self.angle_rad)

    def height_over_mm(self, x_mm: Array, z_mm: Array) -> Array:
        """Distance of a point from the mirror's plane, positive on the gel's side."""
        return (x_mm - self.upper_x_mm) * -self.sin + (z_mm - self.upper_z_mm) * self.cos

    def reflected(self, x_mm: Array, z_mm: Array) -> tuple[Array, Array]:
        """The mirror image of a point."""
        away = self.height_over_mm(x_mm, z_mm)
        return x_mm + 2 * away * self.sin, z_mm - 2 * away * self.cos

    def lower_end_x_mm(self, p: FoldProblem) -> Array:
        """Where the glass ends, its border included."""
        return self.lower_x_mm - p.mirror_border_mm * self.cos

    def depth_mm(self, p: FoldProblem) -> Array:
        """How far the glass reaches below the window."""
        back_z = self.lower_z_mm - p.mirror_border_mm * self.sin - p.mirror_thickness_mm * self.cos
        return p.window_z_mm - back_z


def mirror(p: FoldProblem, s: Sight, angle_rad: Array) -> Mirror:
    """The mirror at this angle whose upper end, border included, just clears the window."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    upper_z = p.window_z_mm - p.clearance_mm - p.mirror_border_mm * sin
    upper_x = s.far_edge_x_mm(upper_z)
    length = (upper_x - s.virtual_x_mm - s.shallowest * (upper_z - s.virtual_z_mm)) / (
        cos - s.shallowest * sin
    )
    lower_x, lower_z = upper_x - length * cos, upper_z - length * sin
    return Mirror(
        angle_rad=angle_rad,
        upper_x_mm=upper_x,
        upper_z_mm=upper_z,
        lower_x_mm=lower_x,
        lower_z_mm=lower_z,
        length_mm=length,
        half_width_mm=np.maximum(
            s.near_corner_across * (lower_z - s.virtual_z_mm),
            s.far_corner_across * (upper_z - s.virtual_z_mm),
        ),
    )
