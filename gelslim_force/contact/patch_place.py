"""Patches of known shape fitted to an outline, and the share of a rim that is visible."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from gelslim_force.contact.indenter import Flat
from gelslim_force.contact.patch import ContactPatch

Array = NDArray[np.float64]
_RIM_POINTS = 180
_OUTLINE_SHIFT = 0.05
"""Error of a flat punch's position over its size, from light that changes unevenly around it."""


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
