"""Known outlines laid on what is seen, and how much of a rim is seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from gelslim_force.contact.indenter import Flat
from gelslim_force.contact.patch import ContactPatch

Array = NDArray[np.float64]
RIM_POINTS = 180
OUTLINE_SHIFT = 0.05
"""Error of a flat punch's place over its size, from light that changes unevenly beside it."""


def flat_patch(punch: Flat, rim_mm: Array, inside_mm: Array) -> ContactPatch | None:
    """Place (and turn, of a rectangle) of a punch of known size.

    `rim_mm` (n, 2) are outline points of what changed, which is wider by an unknown margin: the
    margin is fitted with the place. None where the fit fails.
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

    def apart(p: Array) -> Array:
        return np.asarray(shape(p).outside_mm(*rim_mm.T) - p[2])

    fits = [least_squares(apart, s, loss="soft_l1", f_scale=0.2, max_nfev=60) for s in starts]
    best = min(fits, key=lambda f: float(f.cost))
    if not np.isfinite(best.x).all():
        return None
    patch = shape(best.x)
    left = apart(best.x)
    variance = 2 * float(left @ left) / max(len(left) - len(best.x), 1)
    found = np.linalg.pinv(best.jac.T @ best.jac) * variance
    covariance = np.zeros((4, 4))
    kept = [0, 1] if round_punch else [0, 1, 3]
    into = [0, 1] if round_punch else [0, 1, 3]
    covariance[np.ix_(into, into)] = found[np.ix_(kept, kept)]
    covariance[:2, :2] += np.eye(2) * (OUTLINE_SHIFT * patch.size_mm) ** 2
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
    """Strip whose centre is the point of its middle line next to `near` (2,)."""
    across = np.array([-np.sin(angle), np.cos(angle)])
    centre = near + (offset - near @ across) * across
    return ContactPatch("strip", centre, float(half), float(np.rad2deg(angle)))


def strip_covariance(found: Array, angle: float) -> Array:
    """(4, 4) from that (3, 3) of offset, half-width and angle: nothing is known along the strip."""
    across = np.array([-np.sin(angle), np.cos(angle)])
    spread = np.zeros((4, 3))
    spread[:2, 0] = across
    spread[2, 1] = spread[3, 2] = 1.0
    return np.asarray(spread @ found @ spread.T)


def rim_points(patch: ContactPatch, reach_mm: float) -> Array:
    """Points (n, 2) along the rim; of a strip, within `reach_mm` of its centre."""
    if patch.kind == "disc":
        turn = np.linspace(0, 2 * np.pi, RIM_POINTS, endpoint=False)
        local = patch.size_mm * np.column_stack([np.cos(turn), np.sin(turn)])
    elif patch.kind == "strip":
        along = np.linspace(-reach_mm, reach_mm, RIM_POINTS // 2)
        side = np.full_like(along, patch.size_mm)
        local = np.vstack([np.column_stack([along, side]), np.column_stack([along, -side])])
    else:
        a, b, t = patch.size_mm, patch.length_mm, np.linspace(-1, 1, RIM_POINTS // 4)
        sides = [(a * t, b + 0 * t), (a * t, -b + 0 * t), (a + 0 * t, b * t), (-a + 0 * t, b * t)]
        local = np.vstack([np.column_stack(s) for s in sides])
    c, s = np.cos(np.deg2rad(patch.angle_deg)), np.sin(np.deg2rad(patch.angle_deg))
    return np.asarray(patch.centre_mm + local @ np.array([[c, s], [-s, c]]))


def rim_share(patch: ContactPatch, pad: cKDTree, near_mm: float) -> float:
    """Share of the rim further than `near_mm` from every bin of the pad (a tree of places in mm).

    Of a strip, whose ends always lie beyond the pad, the share of its long sides of which the
    pad's other side is seen at the same place.
    """
    rim = rim_points(patch, float((pad.maxes - pad.mins).max()) / 2)
    apart, _ = pad.query(rim, distance_upper_bound=near_mm)
    seen = np.isfinite(apart)
    if patch.kind == "strip":
        half = len(seen) // 2
        either = seen[:half] | seen[half:]
        seen = np.concatenate([seen[:half][either], seen[half:][either]])
    return float(1 - seen.mean()) if len(seen) else 1.0
