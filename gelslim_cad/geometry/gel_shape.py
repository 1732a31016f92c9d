"""Shape of the gel pad in closed form: outline, crowned surface, volume. No CAD."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_cad.markers.outline import Outline

SNAP_MM = 1e-4
"""A corner radius this close to 0 or to half the shorter side, or a crown this close to 0, is
drawn as such: solid modellers do not resolve the slivers that would be left."""


@dataclass(frozen=True)
class GelShape:
    """A rounded rectangle of gel, flat or crowned, in the sensor frame (mm).

        z = 0      .-----^-----.       apex (0, 0, 0) of a crowned gel
                 .'             '.     z = -crown (x² + y²) / rim²
        -crown  |                 |    at the outline's farthest points (the corners)
                |                 |    thickness: edge thickness there, more elsewhere
        bottom  '-----------------'    z = -(edge thickness + crown)

    The crown is a paraboloid of revolution about z. It differs from the sphere through the same
    apex and rim by at most crown³ / (4 rim²) to first order (1.3 µm for a crown of 1 mm over
    28 x 28 mm) and, unlike the sphere, exists for every crown, also one higher than the rim is
    far.
    """

    length_mm: float
    width_mm: float
    corner_radius_mm: float
    edge_thickness_mm: float
    crown_mm: float = 0.0

    @classmethod
    def of(cls, d: Mapping[str, Any] | Any) -> GelShape:
        """Return the shape that `d` (Dimensions, or any lookup by dotted name) asks for."""
        length, width = float(d["design.gel.length_mm"]), float(d["design.gel.width_mm"])
        radius, half = float(d["design.gel.corner_radius_mm"]), min(length, width) / 2
        if radius < SNAP_MM:
            radius = 0.0
        elif half - radius < SNAP_MM:
            radius = half
        edge = float(d["design.gel.thickness_mm"])
        crown = float(d["design.gel.crown_height_mm"])
        if crown < SNAP_MM:
            edge, crown = edge + crown, 0.0
        return cls(length, width, radius, edge, crown)

    @property
    def thickness_mm(self) -> float:
        """Thickness at the centre: edge thickness and crown."""
        return self.edge_thickness_mm + self.crown_mm

    @property
    def rim_mm(self) -> float:
        """Distance of the outline's farthest points from the centre: √((a-r)² + (b-r)²) + r."""
        r = self.corner_radius_mm
        return math.hypot(self.length_mm / 2 - r, self.width_mm / 2 - r) + r

    @property
    def outline(self) -> Outline:
        """The outline in the x-y plane."""
        return Outline.rounded_rectangle(self.length_mm, self.width_mm, self.corner_radius_mm)

    @property
    def area_mm2(self) -> float:
        """Area of the outline, L W - (4 - π) r²."""
        return self.length_mm * self.width_mm - (4 - math.pi) * self.corner_radius_mm**2

    @property
    def volume_mm3(self) -> float:
        """Area times thickness, less crown / rim² times the outline's polar moment."""
        volume = self.area_mm2 * self.thickness_mm
        if self.crown_mm:
            volume -= self.crown_mm / self.rim_mm**2 * self._polar_moment_mm4()
        return volume

    def surface_z_mm(self, x_mm: ArrayLike, y_mm: ArrayLike) -> NDArray[np.float64]:
        """Height of the outer surface over points (broadcast), 0 at the centre."""
        x, y = np.asarray(x_mm, dtype=float), np.asarray(y_mm, dtype=float)
        return -self.crown_mm / self.rim_mm**2 * (x**2 + y**2) + 0.0

    def inset_corner_mm(self, inset_mm: float) -> tuple[float, float]:
        """Centre of the circle of radius `inset_mm` that touches the outline in its corner."""
        a, b, r = self.length_mm / 2, self.width_mm / 2, self.corner_radius_mm
        if r <= inset_mm:
            return a - inset_mm, b - inset_mm
        along = (r - inset_mm) * math.sqrt(0.5)
        return a - r + along, b - r + along

    def scaled(self, factor: float) -> GelShape:
        """The shape with every length multiplied by `factor`."""
        return GelShape(
            self.length_mm * factor,
            self.width_mm * factor,
            self.corner_radius_mm * factor,
            self.edge_thickness_mm * factor,
            self.crown_mm * factor,
        )

    def _polar_moment_mm4(self) -> float:
        """Polar moment ∫ x² + y² of the outline: the rectangle without its four cut corners.

        With (p, q) the corner arc's centre, ∫ (p + u)² over the square of side r is
        p²r² + p r³ + r⁴/3, over the quarter disc p² π r²/4 + 2 p r³/3 + π r⁴/16.
        """
        length, width, r = self.length_mm, self.width_mm, self.corner_radius_mm
        rectangle = length * width * (length**2 + width**2) / 12
        cut = 0.0
        for p in (length / 2 - r, width / 2 - r):
            cut += p**2 * r**2 * (1 - math.pi / 4)
            cut += p * r**3 / 3 + r**4 * (1 / 3 - math.pi / 16)
        return rectangle - 4 * cut


def has_markers(d: Mapping[str, Any] | Any) -> bool:
    """Whether markers are printed on the gel of `d` (Dimensions, or any lookup by dotted name)."""
    return bool(d["design.markers.pattern"] != "none")
