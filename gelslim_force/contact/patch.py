"""The contact patch: the region in which the indenter touches the gel."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from gelslim_force.contact.indenter import Flat, PatchKind

Array = NDArray[np.float64]
_RIM_POINTS = 180
_OUTLINE_SHIFT = 0.05
"""Error of a flat punch's position over its size, from light that changes unevenly around it."""


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


def flat_patch(punch: Flat, rim_mm: Array, inside_mm: Array) -> ContactPatch | None:
    """Patch of a punch of known size: its position, and the angle of a rectangle.

    `rim_mm` (n, 2) are points on the outline of the changed region, which is larger than the punch
    by an unknown margin. The margin is fitted together with the position. None where the fit fails.
    """
    middle = inside_mm.mean(axis=0)
    round_punch = punch.half_sizes_mm is None
    if round_punch:
        assert punch.radius_mm is not None
        starts = [np.array([*middle, 0.0])]
    else:
        spread = inside_mm - middle
        _, _, axes = np.linalg.svd(spread, full_matrices=False)
        along = float(np.arctan2(axes[0, 1], axes[0, 0]))
        starts = [np.array([*middle, 0.0, along + turn]) for turn in (0.0, np.pi / 2)]

    def shape(p: Array) -> ContactPatch:
        if round_punch:
            return ContactPatch("disc", p[:2], float(punch.radius_mm or 0.0))
        a, b = punch.half_sizes_mm or (0.0, 0.0)
        return ContactPatch("outline", p[:2], a, float(np.rad2deg(p[3])), b)

    def distance(p: Array) -> Array:
        return np.asarray(shape(p).outside_mm(*rim_mm.T) - p[2])

    fits = [least_squares(distance, s, loss="soft_l1", f_scale=0.2, max_nfev=60) for s in starts]
    best = min(fits, key=lambda f: float(f.cost))
    if not np.isfinite(best.x).all():
        return None
    patch = shape(best.x)
    left = distance(best.x)
    variance = 2 * float(left @ left) / max(len(left) - len(best.x), 1)
    found = np.linalg.pinv(best.jac.T @ best.jac) * variance
    covariance = np.zeros((4, 4))
    fitted = [0, 1] if round_punch else [0, 1, 3]
    covariance[np.ix_(fitted, fitted)] = found[np.ix_(fitted, fitted)]
    covariance[:2, :2] += np.eye(2) * (_OUTLINE_SHIFT * patch.size_mm) ** 2
    angle = (patch.angle_deg + 90.0) % 180.0 - 90.0
    return ContactPatch(
        patch.kind,
        patch.centre_mm,
        patch.size_mm,
        0.0 if round_punch else angle,
        patch.length_mm,
        covariance,
        method="outline",
    )


def strip_patch(offset: float, half: float, angle: float, near: Array) -> ContactPatch:
    """Strip whose centre is the point of its middle line nearest to `near` (2,)."""
    across = np.array([-np.sin(angle), np.cos(angle)])
    centre = near + (offset - near @ across) * across
    return ContactPatch("strip", centre, float(half), float(np.rad2deg(angle)))


def strip_covariance(found: Array, angle: float) -> Array:
    """(4, 4) from that (3, 3) of offset, half-width and angle; the position along it has none."""
    across = np.array([-np.sin(angle), np.cos(angle)])
    spread = np.zeros((4, 3))
    spread[:2, 0] = across
    spread[2, 1] = spread[3, 2] = 1.0
    return np.asarray(spread @ found @ spread.T)


def rim_points(patch: ContactPatch, reach_mm: float) -> Array:
    """Points (n, 2) along the rim; of a strip, within `reach_mm` of its centre."""
    if patch.kind == "disc":
        turn = np.linspace(0, 2 * np.pi, _RIM_POINTS, endpoint=False)
        local = patch.size_mm * np.column_stack([np.cos(turn), np.sin(turn)])
    elif patch.kind == "strip":
        along = np.linspace(-reach_mm, reach_mm, _RIM_POINTS // 2)
        side = np.full_like(along, patch.size_mm)
        local = np.vstack([np.column_stack([along, side]), np.column_stack([along, -side])])
    else:
        a, b, t = patch.size_mm, patch.length_mm, np.linspace(-1, 1, _RIM_POINTS // 4)
        sides = [(a * t, b + 0 * t), (a * t, -b + 0 * t), (a + 0 * t, b * t), (-a + 0 * t, b * t)]
        local = np.vstack([np.column_stack(s) for s in sides])
    c, s = np.cos(np.deg2rad(patch.angle_deg)), np.sin(np.deg2rad(patch.angle_deg))
    return np.asarray(patch.centre_mm + local @ np.array([[c, s], [-s, c]]))


def rim_share(patch: ContactPatch, pad: cKDTree, near_mm: float) -> float:
    """Share of the rim that is farther than `near_mm` from every bin of the pad (a tree, in mm).

    The ends of a strip are always outside the pad. Of a strip only those parts of the long sides
    count where at least one of the two sides is on the pad.
    """
    rim = rim_points(patch, float((pad.maxes - pad.mins).max()) / 2)
    distance, _ = pad.query(rim, distance_upper_bound=near_mm)
    seen = np.isfinite(distance)
    if patch.kind == "strip":
        half = len(seen) // 2
        either = seen[:half] | seen[half:]
        seen = np.concatenate([seen[:half][either], seen[half:][either]])
    return float(1 - seen.mean()) if len(seen) else 1.0
