"""The contact patch: the region in which the indenter touches the gel."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_force.contact.indenter import PatchKind

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ContactPatch:
    """A disc, a strip across the pad or a rectangle, fitted to the picture.

    Positions are correct for a rim at the height `z_mm`; see `at_height`.
    """

    kind: PatchKind
    centre_mm: Array
    """(2,) x and y; of a strip, the point of its middle line nearest to the changed region."""
    size_mm: float
    """Radius of a disc, half-width of a strip, half-width along x' of a rectangle."""
    angle_deg: float = 0.0
    """Direction x' of a strip's middle line or of a rectangle, from x towards y."""
    length_mm: float = 0.0
    """Half-length along y' of a rectangle."""
    covariance: Array = field(default_factory=lambda: np.zeros((4, 4)))
    """(4, 4) of (x, y, size, angle) in mm and rad; zero rows for values that were not fitted."""
    rim_share: float = 0.0
    """Share of the rim that is beyond the pad's edge or outside the picture."""
    contrast: float = 0.0
    """Change of shading in the patch over the noise around it."""
    method: str = ""
    """`shading`: from the slopes under the indenter; `outline`: from the changed region alone."""
    z_mm: float = 0.0
    """Height that was assumed for the rim."""
    parallax: Array = field(default_factory=lambda: np.zeros(2))
    """(2,) displacement of the line of sight along x and y, in mm per mm of height."""
    growth_per_mm: float = 0.0
    """Relative change of a length seen there, per mm of height."""

    @property
    def sigma_mm(self) -> float:
        """Standard deviation of the size."""
        return float(np.sqrt(self.covariance[2, 2]))

    def at_height(self, z_mm: float) -> ContactPatch:
        """The same patch under the assumption of another height of the rim."""
        rise_mm = z_mm - self.z_mm
        scale = 1.0 + self.growth_per_mm * rise_mm
        return replace(
            self,
            centre_mm=self.centre_mm + self.parallax * rise_mm,
            size_mm=self.size_mm * scale,
            length_mm=self.length_mm * scale,
            z_mm=z_mm,
        )

    def local(self, x_mm: ArrayLike, y_mm: ArrayLike) -> tuple[Array, Array]:
        """Offsets (n,) along x' and y' of points (n,) from the centre."""
        return rotated(x_mm, y_mm, self.centre_mm, np.deg2rad(self.angle_deg))

    def outside_mm(self, x_mm: ArrayLike, y_mm: ArrayLike) -> Array:
        """Distance (n,) of points (n,) from the rim, negative inside.

        Near the corner of a rectangle it is the larger of the distances from its sides.
        """
        along, across = self.local(x_mm, y_mm)
        if self.kind == "disc":
            return np.asarray(np.hypot(along, across) - self.size_mm)
        if self.kind == "strip":
            return np.asarray(np.abs(across) - self.size_mm)
        return np.maximum(np.abs(along) - self.size_mm, np.abs(across) - self.length_mm)


def rotated(
    x_mm: ArrayLike, y_mm: ArrayLike, centre_mm: Array, angle_rad: float
) -> tuple[Array, Array]:
    """Offsets from a centre along axes rotated by an angle from x towards y."""
    dx, dy = np.asarray(x_mm, dtype=float) - centre_mm[0], np.asarray(y_mm) - centre_mm[1]
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return c * dx + s * dy, c * dy - s * dx
