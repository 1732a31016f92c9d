"""The contact patch: where the indenter touches the gel."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_force.contact.indenter import PatchKind

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ContactPatch:
    """A disc, a strip across the pad or a rectangle, fitted to what the camera sees.

    Positions hold for a rim seen at the height `z_mm`; see `at_height`.
    """

    kind: PatchKind
    centre_mm: Array
    """(2,) x and y; of a strip, the point of its middle line nearest to what was seen."""
    size_mm: float
    """Radius of a disc, half-width of a strip, half-width along x' of a rectangle."""
    angle_deg: float = 0.0
    """Direction x' of a strip's middle line or of a rectangle, from x towards y."""
    length_mm: float = 0.0
    """Half-length along y' of a rectangle."""
    covariance: Array = field(default_factory=lambda: np.zeros((4, 4)))
    """(4, 4) of (x, y, size, angle) in mm and rad; zero rows for what was not fitted."""
    rim_share: float = 0.0
    """Share of the rim that lies beyond the pad's edge or out of the picture."""
    contrast: float = 0.0
    """Change of shading in the patch over the noise beside it."""
    method: str = ""
    """`shading`: the slopes under the indenter fitted; `outline`: only where the light changes."""
    z_mm: float = 0.0
    """Height at which the rim was taken to be."""
    lean: Array = field(default_factory=lambda: np.zeros(2))
    """(2,) mm that the line of sight moves along x and y per mm of height."""
    growth_per_mm: float = 0.0
    """Relative growth of a length seen there per mm of height."""

    @property
    def sigma_mm(self) -> float:
        """Standard deviation of the size."""
        return float(np.sqrt(self.covariance[2, 2]))

    def at_height(self, z_mm: float) -> ContactPatch:
        """The same picture taken to show a rim at another height."""
        up = z_mm - self.z_mm
        size = 1.0 + self.growth_per_mm * up
        return replace(
            self,
            centre_mm=self.centre_mm + self.lean * up,
            size_mm=self.size_mm * size,
            length_mm=self.length_mm * size,
            z_mm=z_mm,
        )

    def local(self, x_mm: ArrayLike, y_mm: ArrayLike) -> tuple[Array, Array]:
        """Offsets (n,) along x' and y' of points (n,) from the centre."""
        return turned(x_mm, y_mm, self.centre_mm, np.deg2rad(self.angle_deg))

    def outside_mm(self, x_mm: ArrayLike, y_mm: ArrayLike) -> Array:
        """Distance (n,) of points (n,) from the rim, negative within it.

        Beside a rectangle's corner, the greater of the distances from its sides.
        """
        along, across = self.local(x_mm, y_mm)
        if self.kind == "disc":
            return np.asarray(np.hypot(along, across) - self.size_mm)
        if self.kind == "strip":
            return np.asarray(np.abs(across) - self.size_mm)
        return np.maximum(np.abs(along) - self.size_mm, np.abs(across) - self.length_mm)


def turned(
    x_mm: ArrayLike, y_mm: ArrayLike, centre_mm: Array, angle_rad: float
) -> tuple[Array, Array]:
    """Offsets from a centre along axes turned by an angle from x towards y."""
    dx, dy = np.asarray(x_mm, dtype=float) - centre_mm[0], np.asarray(y_mm) - centre_mm[1]
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return c * dx + s * dy, c * dy - s * dx
