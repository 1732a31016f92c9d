"""The search of `solver` compiled, for batches of designs: same grids, same score, same winners.

`fold.fold` is the reference. Candidates are scored one by one against the best so far and left as
soon as they cannot beat it: missed limits only add up, and a part of the depth bounds the whole.
Importing this module loads numba.
"""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gelslim_cad.dimensions import solver
from gelslim_cad.dimensions.fold_problem import FoldProblem

Array = NDArray[np.float64]
NEWTON_STEPS = 40
FEASIBLE = 1e-9
LAST_STEP = 1e-8
"""Newton's error after a step of this part of the slope is its square, below rounding."""


def search(problem: FoldProblem) -> tuple[Array, Array, Array]:
    """Winning mean ray angle, spread and mirror angle, (n,) each; releases the GIL."""
    rows = np.column_stack([np.ravel(getattr(problem, f.name)) for f in fields(FoldProblem)])
    axes = [np.linspace(*a) for a in zip(solver.LOWER, solver.UPPER, solver.COARSE, strict=True)]
    bands = np.array([len(b) for b in np.array_split(axes[0], solver.STARTS)])
    width = (solver.UPPER - solver.LOWER) / (np.array(solver.COARSE) - 1)
    found = _search_all(
        rows,
        (axes[0], axes[1], axes[2]),
        bands,
        (solver.LOWER, solver.UPPER, width, np.linspace(-1.0, 1.0, solver.FINE)),
        (solver.LEVELS, solver.SHRINK),
        (solver.INFEASIBLE_MM, solver.KEYSTONE_WEIGHT_MM, solver.LENGTH_WEIGHT),
    )
    return found[:, 0].copy(), found[:, 1].copy(), found[:, 2].copy()


def scores(problem: FoldProblem, mid: Array, spread: Array, mirror: Array) -> Array:
    """Score (n,) of one candidate per design, as `solver.objective` of `fold.fold` gives it."""
    rows = np.column_stack([np.ravel(getattr(problem, f.name)) for f in fields(FoldProblem)])
    weights = (solver.INFEASIBLE_MM, solver.KEYSTONE_WEIGHT_MM, solver.LENGTH_WEIGHT)
    return np.array(
        [
            _mirror_score(row, _view(row, m, s), math.cos(a), math.sin(a), np.inf, weights)
            for row, m, s, a in zip(rows, mid, spread, mirror, strict=True)
        ]
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _search_all(rows, axes, bands, box, levels, weights):  # type: ignore[no-untyped-def]
    found = np.empty((len(rows), 3))
    for k in range(len(rows)):
        found[k] = _search_one(rows[k], axes, bands, box, levels, weights)
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _search_one(row, axes, bands, box, levels, weights):  # type: ignore[no-untyped-def]
    """Best candidate of one design: each band's best, refined by itself."""
    lower, upper, first_width, ticks = box
    winner, best = np.zeros(3), np.inf
    begin = 0
    for count in bands:
        band = (axes[0][begin : begin + count], axes[1], axes[2])
        begin += count
        at, score = np.array([band[0][0], band[1][0], band[2][0]]), np.inf
        score = _grid(row, band, at, score, weights)
        width = first_width.copy()
        for _ in range(levels[0]):
            near = np.empty((3, len(ticks)))
            for a in range(3):
                for t in range(len(ticks)):
                    near[a, t] = min(max(at[a] + ticks[t] * width[a], lower[a]), upper[a])
            score = _grid(row, (near[0], near[1], near[2]), at, score, weights)
            width *= levels[1]
        if score < best:
            winner, best = at, score
    return winner


@njit(cache=True, nogil=True, error_model="numpy")
def _grid(row, axes, at, known, weights):  # type: ignore[no-untyped-def]
    """Best score of a grid that holds a candidate of score `known`; `at` moves to the first best.

    Equals are scored to the end: the first of them wins, as in the reference.
    """
    best = np.inf
    cosines, sines = np.cos(axes[2]), np.sin(axes[2])
    for mid in axes[0]:
        for spread in axes[1]:
            view = _view(row, mid, spread)
            if _worse(view[-1], min(known, best), weights):
                continue
            for k in range(len(axes[2])):
                score = _mirror_score(row, view, cosines[k], sines[k], min(known, best), weights)
                if score < best:
                    best = score
                    at[0], at[1], at[2] = mid, spread, axes[2][k]
    return min(known, best)


@njit(cache=True, nogil=True, error_model="numpy")
def _view(p, mid, spread):  # type: ignore[no-untyped-def]
    """What the two ray angles fix; last, how far its limits are missed."""
    length, width, gel, n_gel, guide, n_guide, tan_h, tan_v = p[:8]
    focal, focal_px, aperture, travel_mm, nearest = p[8], p[9], p[10], p[11], p[12]
    half = math.atan(tan_v)
    near, far = mid - spread * half, mid + spread * half
    sn, sf = math.tan(near), math.tan(far)
    reach_n = _reach(sn, guide, n_guide, gel, n_gel)
    reach_f = _reach(sf, guide, n_guide, gel, n_gel)
    air = max((length - (reach_f - reach_n)) / (sf - sn), 1.0)
    vx = -length / 2 - (air * sn + reach_n)
    nx, ny = _corner(-length / 2 - vx, width / 2, air, guide, n_guide, gel, n_gel)
    fx, fy = _corner(length / 2 - vx, width / 2, air, guide, n_guide, gel, n_gel)
    shallowest, steepest = min(sn, nx), max(sf, fx)
    lowest, highest = math.atan(shallowest), math.atan(steepest)
    tilt = min(max(0.0, highest - half), lowest + half)
    apparent = air + guide / n_guide + gel / n_gel
    st, ct = math.sin(tilt), math.cos(tilt)
    z_near, z_far = apparent * (ct + sn * st), apparent * (ct + sf * st)
    least, most = min(z_near, z_far), max(z_near, z_far)
    horizontal = max(ny / (nx * st + ct), fy / (fx * st + ct))
    vertical = math.tan(max(highest - tilt, tilt - lowest))
    focus = 2 * z_near * z_far / (z_near + z_far)
    travel = 0.0 if focus >= nearest else focal**2 / max(focus - focal, 1e-3)
    px = focal_px * p[23] / most * min(1.0, apparent / most)
    blur = aperture * (most - least) / (2 * least)
    missed = max(vertical / tan_v - 1, 0.0) + max(horizontal / tan_h - 1, 0.0)
    missed += max(blur / p[24] - 1, 0.0) + max(p[25] / px - 1, 0.0)
    missed += max(most / least / p[26] - 1, 0.0) + max(2.0 - air, 0.0)
    missed += max((travel - travel_mm) / max(travel_mm, 0.1), 0.0)
    return vx, air, shallowest, steepest, ct, st, most / least, missed


@njit(cache=True, nogil=True, error_model="numpy")
def _mirror_score(p, view, ca, sa, known, weights):  # type: ignore[no-untyped-def]
    """`solver.objective` of one candidate; inf once it is certain to be above `known`."""
    vx, air, shallowest, steepest, ct, st, keystone, missed = view
    gap, border = p[19], p[18]
    window = -(p[4] + p[2])
    vz = window - air
    upper_z = window - gap - border * sa
    upper_x = vx + steepest * (upper_z - vz)
    down = (upper_x - vx - shallowest * (upper_z - vz)) / (ca - shallowest * sa)
    lower_x, lower_z = upper_x - down * ca, upper_z - down * sa
    away = (vx - upper_x) * -sa + (vz - upper_z) * ca
    cx, cz = vx + 2 * away * sa, vz - 2 * away * ca
    lower_end = lower_x - border * ca
    missed += max(max(-down, vz - lower_z) / 10, 0.0)
    missed += max((cx + gap - lower_end) / 10, 0.0)
    mirror_depth = window - (lower_z - border * sa - p[17] * ca)
    depth, tie = max(mirror_depth, window - cz + gap, p[22]), weights[1] * (keystone - 1)
    # The barrel's front is about the pinhole: the housing is no higher and no farther ahead.
    if depth + tie - weights[2] * cx > known or _worse(missed, known, weights):
        return np.inf
    # Pitch = 90 deg - 2 mirror - tilt.
    s2, c2 = 2 * sa * ca, ca * ca - sa * sa
    c, s = s2 * ct + c2 * st, c2 * ct - s2 * st
    half, radius, face = p[13] / 2, p[15] / 2, -p[16]
    rear = face - p[14]
    ledge_z = window - p[20]
    ledge = min(-p[0] / 2 - 0.2, vx + shallowest * (ledge_z - vz) - gap)
    ledge_x = ledge - p[21]
    top, bottom, back = -np.inf, np.inf, np.inf
    beside, behind, before, under = -np.inf, -np.inf, -np.inf, -np.inf
    for k in range(6):
        a = 0.0 if k < 2 else (face if k < 4 else rear)
        b = (radius if k < 2 else half) * (1 if k % 2 == 0 else -1)
        x, z = cx + a * c + b * s, cz - a * s + b * c
        top, bottom, back = max(top, z), min(bottom, z), min(back, x)
        beside = max(beside, x - (vx + shallowest * (z - vz)) + gap)
        behind = max(behind, gap - ((x - upper_x) * -sa + (z - upper_z) * ca))
        before = max(before, x - lower_end + gap)
        under = max(under, min(x - ledge_x, z - ledge_z + gap))
    missed += max((top - window + gap) / 10, 0.0) + max(beside / 10, 0.0)
    missed += max(min(behind, before) / 10, 0.0)
    if _worse(missed, known, weights):
        return np.inf
    outside = _outside(ledge_x - cx, ledge_z - cz, c, s, p[16], half, radius)
    missed += max(max(under, gap - outside) / 10, 0.0)
    climb, seen = (upper_z - cz) / (upper_x - cx), -np.inf
    for x in (ledge, ledge_x):
        if x > cx:
            seen = max(seen, cz + climb * (x - cx))
    missed += max((seen + gap - ledge_z) / 10, 0.0)
    if missed > FEASIBLE:
        return weights[0] * (1 + missed)
    return max(depth, window - bottom + gap) + tie - weights[2] * back


@njit(cache=True, nogil=True, error_model="numpy")
def _worse(missed, known, weights):  # type: ignore[no-untyped-def]
    return missed > FEASIBLE and weights[0] * (1 + missed) > known


@njit(cache=True, nogil=True, error_model="numpy")
def _outside(dx, dz, c, s, lens_height, half, radius):  # type: ignore[no-untyped-def]
    ahead, above = dx * c - dz * s, dx * s + dz * c
    return min(max(ahead + lens_height, above - half), max(ahead, above - radius))


@njit(cache=True, nogil=True, error_model="numpy")
def _reach(t, guide, n_guide, gel, n_gel):  # type: ignore[no-untyped-def]
    """`refraction.lateral_reach`; h s / sqrt(n² - s²) is h t / sqrt(n² + (n² - 1) t²)."""
    guided = math.sqrt(n_guide**2 + (n_guide**2 - 1) * t * t)
    return guide * t / guided + gel * t / math.sqrt(n_gel**2 + (n_gel**2 - 1) * t * t)


@njit(cache=True, nogil=True, error_model="numpy")
def _corner(along, across, air, guide, n_guide, gel, n_gel):  # type: ignore[no-untyped-def]
    """Slopes along and across of the ray to a corner, by the Newton of `refraction.ray_slope`.

    Started from the paraxial slope: the reach is concave, so that one, too, is below the root.
    """
    reach = math.sqrt(along * along + across * across)
    g2, p2 = n_guide * n_guide, n_gel * n_gel
    t = reach / (air + guide / n_guide + gel / n_gel)
    for _ in range(NEWTON_STEPS):
        g, p = g2 + (g2 - 1) * t * t, p2 + (p2 - 1) * t * t
        over_g, over_p = guide / (g * math.sqrt(g)), gel / (p * math.sqrt(p))
        short = reach - t * (air + over_g * g + over_p * p)
        step = short / (air + over_g * g2 + over_p * p2)
        t += step
        if abs(step) <= LAST_STEP * (1 + t):
            break
    return t * along / reach, t * across / reach
