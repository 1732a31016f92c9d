"""The search of `solver` compiled, for batches of designs: same candidates, same order, same score.

`fold.fold` is the reference; here candidates are scored one by one, and two ray angles that
cannot win are left before the mirror is turned. Importing this module loads numba.
"""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gelslim_cad.dimensions import solver
from gelslim_cad.dimensions.fold import FoldProblem

Array = NDArray[np.float64]
NEWTON_STEPS = 40
FEASIBLE = 1e-9


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
            _mirror_score(row, _view(row, m, s), a, weights)
            for row, m, s, a in zip(rows, mid, spread, mirror, strict=True)
        ]
    )


@njit(cache=True, nogil=True)
def _search_all(rows, axes, bands, box, levels, weights):  # type: ignore[no-untyped-def]
    found = np.empty((len(rows), 3))
    for k in range(len(rows)):
        found[k] = _search_one(rows[k], axes, bands, box, levels, weights)
    return found


@njit(cache=True, nogil=True)
def _search_one(row, axes, bands, box, levels, weights):  # type: ignore[no-untyped-def]
    """Best candidate of one design: each band's best, refined by itself."""
    lower, upper, first_width, ticks = box
    winner, best = np.zeros(3), np.inf
    begin = 0
    for count in bands:
        band = (axes[0][begin : begin + count], axes[1], axes[2])
        begin += count
        at, score = _grid(row, band, weights)
        width = first_width.copy()
        for _ in range(levels[0]):
            near = np.empty((3, len(ticks)))
            for a in range(3):
                for t in range(len(ticks)):
                    near[a, t] = min(max(at[a] + ticks[t] * width[a], lower[a]), upper[a])
            at, score = _grid(row, (near[0], near[1], near[2]), weights)
            width *= levels[1]
        if score < best:
            winner, best = at, score
    return winner


@njit(cache=True, nogil=True)
def _grid(row, axes, weights):  # type: ignore[no-untyped-def]
    """First best candidate of a grid, in the order of its axes."""
    at, best = np.array([axes[0][0], axes[1][0], axes[2][0]]), np.inf
    for mid in axes[0]:
        for spread in axes[1]:
            view = _view(row, mid, spread)
            missed = view[-1]
            if missed > FEASIBLE and weights[0] * (1 + missed) >= best:
                continue
            for mirror in axes[2]:
                score = _mirror_score(row, view, mirror, weights)
                if score < best:
                    best = score
                    at[0], at[1], at[2] = mid, spread, mirror
    return at, best


@njit(cache=True, nogil=True)
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
    z_near = apparent / math.cos(near) * math.cos(near - tilt)
    z_far = apparent / math.cos(far) * math.cos(far - tilt)
    least, most = min(z_near, z_far), max(z_near, z_far)
    st, ct = math.sin(tilt), math.cos(tilt)
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
    return vx, air, shallowest, steepest, tilt, most / least, missed


@njit(cache=True, nogil=True)
def _mirror_score(p, view, mirror, weights):  # type: ignore[no-untyped-def]
    """`solver.objective` of one candidate."""
    vx, air, shallowest, steepest, tilt, keystone, missed = view
    gap, border = p[19], p[18]
    ca, sa = math.cos(mirror), math.sin(mirror)
    window = -(p[4] + p[2])
    vz = window - air
    upper_z = window - gap - border * sa
    upper_x = vx + steepest * (upper_z - vz)
    down = (upper_x - vx - shallowest * (upper_z - vz)) / (ca - shallowest * sa)
    lower_x, lower_z = upper_x - down * ca, upper_z - down * sa
    away = (vx - upper_x) * -sa + (vz - upper_z) * ca
    cx, cz = vx + 2 * away * sa, vz - 2 * away * ca
    pitch = math.pi / 2 - 2 * mirror - tilt
    c, s = math.cos(pitch), math.sin(pitch)
    half, radius, face = p[13] / 2, p[15] / 2, -p[16]
    rear = face - p[14]
    lower_end = lower_x - border * ca
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
    missed += max(max(-down, vz - lower_z) / 10, 0.0)
    missed += max((top - window + gap) / 10, 0.0) + max(beside / 10, 0.0)
    missed += max(min(behind, before) / 10, 0.0) + max((cx + gap - lower_end) / 10, 0.0)
    outside = _outside(ledge_x - cx, ledge_z - cz, c, s, p[16], half, radius)
    missed += max(max(under, gap - outside) / 10, 0.0)
    climb, seen = (upper_z - cz) / (upper_x - cx), -np.inf
    for x in (ledge, ledge_x):
        if x > cx:
            seen = max(seen, cz + climb * (x - cx))
    missed += max((seen + gap - ledge_z) / 10, 0.0)
    if missed > FEASIBLE:
        return weights[0] * (1 + missed)
    mirror_depth = window - (lower_z - border * sa - p[17] * ca)
    depth = max(mirror_depth, window - bottom + gap, p[22])
    return depth + weights[1] * (keystone - 1) - weights[2] * back


@njit(cache=True, nogil=True)
def _outside(dx, dz, c, s, lens_height, half, radius):  # type: ignore[no-untyped-def]
    ahead, above = dx * c - dz * s, dx * s + dz * c
    return min(max(ahead + lens_height, above - half), max(ahead, above - radius))


@njit(cache=True, nogil=True)
def _reach(slope, guide, n_guide, gel, n_gel):  # type: ignore[no-untyped-def]
    s2 = slope * slope / (1 + slope * slope)
    reach = guide * math.sqrt(s2 / (n_guide**2 - s2)) + gel * math.sqrt(s2 / (n_gel**2 - s2))
    return math.copysign(reach, slope)


@njit(cache=True, nogil=True)
def _corner(along, across, air, guide, n_guide, gel, n_gel):  # type: ignore[no-untyped-def]
    """Slopes along and across of the ray to a corner, by the Newton of `refraction.ray_slope`."""
    reach = math.hypot(along, across)
    t = reach / (air + guide + gel)
    for _ in range(NEWTON_STEPS):
        u = 1 + t * t
        s2 = t * t / u
        g2, p2 = n_guide * n_guide - s2, n_gel * n_gel - s2
        g, q = math.sqrt(g2), math.sqrt(p2)
        value = air * t + (guide / g + gel / q) * math.sqrt(s2) - reach
        bend = guide * n_guide * n_guide / (g2 * g) + gel * n_gel * n_gel / (p2 * q)
        step = -value / (air + bend / (u * math.sqrt(u)))
        t = max(t + step, 0.0)
        if abs(step) <= 1e-14 * (1 + t):
            break
    return t * along / reach, t * across / reach
