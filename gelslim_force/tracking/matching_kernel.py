"""Compiled matching of markers to dots. Import it only where it runs, because it loads numba.

Arrays: `reference` (n, 2) and `expected` (n, 2) positions of the markers in px, `near` (n, k)
neighbours of each marker on the lattice or -1, `pitch` (n,) distance to the nearest of them,
`points` (m, 2) dots of the frame, `match` (n,) dot of each marker or -1, `trusted` (n,) whether
the match is verified by its neighbours.

A marker's position is predicted from the motion of its neighbours. An affine motion needs few
neighbours and extrapolates safely; near a contact the motion changes so fast that only a quadratic
one follows it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from gelslim_force.detection.darkness_kernel import COMPILED

_MAX_LEVEL = 12
FOR_QUADRATIC = 12
"""Least number of neighbours for a quadratic motion, which has 6 coefficients per axis."""
_PIVOT = 1e-3
_MOST_CELLS = 128
"""Cells per side of the square in which the nearest dots are looked up."""
_FAR_PX = 1e6
"""Beyond this nothing is in a picture; also for positions that are not finite."""


@njit(**COMPILED)
def nearest(points: Any, x: Any, y: Any) -> Any:
    """Index of the dot nearest to (x, y) and its squared distance; -1 without dots."""
    best, least = -1, 1e300
    for k in range(points.shape[0]):
        dx, dy = points[k, 0] - x, points[k, 1] - y
        gap = dx * dx + dy * dy
        if gap < least:
            best, least = k, gap
    return best, least


@njit(**COMPILED)
def mutual(expected: Any, points: Any, pitch: Any, gate: Any, match: Any) -> None:
    """Match markers and dots that are mutual nearest neighbours, within `gate` pitches."""
    match[:] = -1
    if len(points) == 0:
        return
    owner = np.full(points.shape[0], -1, dtype=np.int64)
    least = np.full(points.shape[0], 1e300)
    left, top = points[:, 0].min(), points[:, 1].min()
    extent = max(points[:, 0].max() - left, points[:, 1].max() - top)
    size = max(gate * pitch.max(), extent / _MOST_CELLS, 1e-9)
    count = int(extent / size) + 1
    first, following = _cells(points, left, top, size, count)
    for i in range(expected.shape[0]):
        x, y = expected[i, 0], expected[i, 1]
        if not (abs(x) < _FAR_PX and abs(y) < _FAR_PX):
            continue
        best, gap = -1, (gate * pitch[i]) ** 2
        row, column = math.floor((y - top) / size), math.floor((x - left) / size)
        for r in range(max(row - 1, 0), min(row + 2, count)):
            for c in range(max(column - 1, 0), min(column + 2, count)):
                k = first[r, c]
                while k >= 0:
                    dx, dy = points[k, 0] - x, points[k, 1] - y
                    away = dx * dx + dy * dy
                    if away < gap or (away == gap and 0 <= k < best):
                        best, gap = k, away
                    k = following[k]
        if best >= 0 and gap < least[best]:
            owner[best], least[best] = i, gap
    for k in range(points.shape[0]):
        if owner[k] >= 0:
            match[owner[k]] = k


@njit(**COMPILED)
def _cells(points: Any, left: Any, top: Any, size: Any, count: Any) -> Any:
    """First dot of each cell (count, count), and next dot (m,) of the same cell; or -1."""
    first = np.full((count, count), -1, dtype=np.int64)
    following = np.empty(points.shape[0], dtype=np.int64)
    for k in range(points.shape[0]):
        row, column = int((points[k, 1] - top) / size), int((points[k, 0] - left) / size)
        following[k] = first[row, column]
        first[row, column] = k
    return first, following


@njit(**COMPILED)
def verify(
    reference: Any,
    near: Any,
    pitch: Any,
    points: Any,
    match: Any,
    trusted: Any,
    gate: Any,
    rounds: Any,
) -> Any:
    """Trust the matches that the motion of their neighbours predicts; return their number."""
    agrees = np.zeros(reference.shape[0], dtype=np.bool_)
    count = 0
    for _ in range(rounds):
        count, changed = 0, False
        for i in range(reference.shape[0]):
            agrees[i] = False
            if match[i] < 0:
                continue
            limit = (gate * pitch[i]) ** 2
            x, y, n = local_affine(i, reference, near, points, match, trusted)
            dx, dy = points[match[i], 0] - x, points[match[i], 1] - y
            agrees[i] = n >= 4 and dx * dx + dy * dy < limit
            if not agrees[i]:
                x, y, n = local_quadratic(i, reference, near, pitch, points, match, trusted)
                dx, dy = points[match[i], 0] - x, points[match[i], 1] - y
                agrees[i] = n >= 4 and dx * dx + dy * dy < limit
        for i in range(reference.shape[0]):
            changed |= agrees[i] != trusted[i]
            trusted[i] = agrees[i]
            count += agrees[i]
        if not changed:
            break
    return count


@njit(**COMPILED)
def patches(
    reference: Any, near: Any, pitch: Any, points: Any, match: Any, trusted: Any, gate: Any
) -> Any:
    """Return the number (n,) of the patch of each trusted marker, -1 for the others.

    The motion within a patch is smooth. Markers that are wrong by a pitch agree among themselves,
    but the motion has a step where they meet the others.
    """
    patch = np.full(reference.shape[0], -1, dtype=np.int64)
    todo = np.empty(reference.shape[0], dtype=np.int64)
    count = 0
    for seed in range(reference.shape[0]):
        if not trusted[seed] or patch[seed] >= 0:
            continue
        open_ = 1
        todo[0] = seed
        patch[seed] = count
        while open_ > 0:
            open_ -= 1
            i = todo[open_]
            for k in range(near.shape[1]):
                j = near[i, k]
                if j < 0 or not trusted[j] or patch[j] >= 0:
                    continue
                du = reference[j, 0] - reference[i, 0]
                dv = reference[j, 1] - reference[i, 1]
                dx = points[match[j], 0] - points[match[i], 0] - du
                dy = points[match[j], 1] - points[match[i], 1] - dv
                steps = math.sqrt(du * du + dv * dv)
                if math.sqrt(dx * dx + dy * dy) < gate * min(steps, 1.5 * pitch[i]):
                    patch[j] = count
                    todo[open_] = j
                    open_ += 1
        count += 1
    return patch


@njit(**COMPILED)
def grow(
    reference: Any, near: Any, pitch: Any, points: Any, match: Any, trusted: Any, gate: Any
) -> Any:
    """Extend the trusted patch, markers with many trusted neighbours first; return its size."""
    n, m = reference.shape[0], points.shape[0]
    owner = np.full(m, -1, dtype=np.int64)
    offer = np.empty(n, dtype=np.int64)
    gap2 = np.empty(n)
    count = 0
    for i in range(n):
        if trusted[i]:
            owner[match[i]] = i
            count += 1
        else:
            match[i] = -1
    level = 0
    while level < _MAX_LEVEL:
        # Most certain first: small gaps before large ones, many neighbours before few.
        fewest, reach = 12 - 3 * (level % 4), gate * (1 + level // 4) / 3
        added = 0
        for i in range(n):
            offer[i] = -1
            if trusted[i]:
                continue
            x, y, support = local_position(i, reference, near, pitch, points, match, trusted)
            if support < max(fewest, 4):
                continue
            k, gap = nearest(points, x, y)
            gap /= pitch[i] ** 2
            if k < 0 or owner[k] >= 0 or gap > reach * reach:
                continue
            offer[i], gap2[i] = k, gap
        for i in range(n):
            k = offer[i]
            if k < 0:
                continue
            rival = False
            for j in range(n):
                if j != i and offer[j] == k and (gap2[j], j) < (gap2[i], i):
                    rival = True
                    break
            if not rival:
                match[i] = k
                added += 1
        for i in range(n):
            if not trusted[i] and match[i] >= 0:
                trusted[i] = True
                owner[match[i]] = i
        count += added
        level = 0 if added else level + 1
    return count


@njit(**COMPILED)
def local_affine(i: Any, reference: Any, near: Any, points: Any, match: Any, trusted: Any) -> Any:
    """Return where the affine motion of its trusted neighbours puts marker i, and their number.

    The number is 0 if they are fewer than 3 or on one line.
    """
    n = 0
    su = sv = suu = suv = svv = sx = sy = sux = svx = suy = svy = total = 0.0
    for k in range(near.shape[1]):
        j = near[i, k]
        if j < 0 or not trusted[j]:
            continue
        u = reference[j, 0] - reference[i, 0]
        v = reference[j, 1] - reference[i, 1]
        dx = points[match[j], 0] - reference[j, 0]
        dy = points[match[j], 1] - reference[j, 1]
        w = 1.0 / (u * u + v * v)
        n += 1
        total += w
        su += w * u
        sv += w * v
        suu += w * u * u
        suv += w * u * v
        svv += w * v * v
        sx += w * dx
        sy += w * dy
        sux += w * u * dx
        svx += w * v * dx
        suy += w * u * dy
        svy += w * v * dy
    if n < 3:
        return 0.0, 0.0, 0
    mu, mv, mx, my = su / total, sv / total, sx / total, sy / total
    auu, auv, avv = suu / total - mu * mu, suv / total - mu * mv, svv / total - mv * mv
    det = auu * avv - auv * auv
    if det <= 0.05 * auu * avv or auu <= 0 or avv <= 0:
        return 0.0, 0.0, 0
    bux, bvx = sux / total - mu * mx, svx / total - mv * mx
    buy, bvy = suy / total - mu * my, svy / total - mv * my
    x = mx - (mu * (bux * avv - bvx * auv) + mv * (bvx * auu - bux * auv)) / det
    y = my - (mu * (buy * avv - bvy * auv) + mv * (bvy * auu - buy * auv)) / det
    return reference[i, 0] + x, reference[i, 1] + y, n


@njit(**COMPILED)
def local_quadratic(
    i: Any, reference: Any, near: Any, pitch: Any, points: Any, match: Any, trusted: Any
) -> Any:
    """Return where the quadratic motion of its trusted neighbours puts marker i, and their number.

    The number is 0 if they are too few, or too near to one conic, for six coefficients.
    """
    normal = np.zeros((6, 8))
    row = np.empty(8)
    n = 0
    for k in range(near.shape[1]):
        j = near[i, k]
        if j < 0 or not trusted[j]:
            continue
        u = (reference[j, 0] - reference[i, 0]) / pitch[i]
        v = (reference[j, 1] - reference[i, 1]) / pitch[i]
        w = 1.0 / (u * u + v * v)
        row[0], row[1], row[2], row[3], row[4], row[5] = 1.0, u, v, u * u, u * v, v * v
        row[6] = points[match[j], 0] - reference[j, 0]
        row[7] = points[match[j], 1] - reference[j, 1]
        for a in range(6):
            for b in range(a, 8):
                normal[a, b] += w * row[a] * row[b]
        n += 1
    if n < FOR_QUADRATIC:
        return 0.0, 0.0, 0
    # Elimination from the last unknown upwards: the first one is the motion at the marker itself.
    for a in range(6):
        for b in range(a):
            normal[a, b] = normal[b, a]
    for a in range(5, 0, -1):
        pivot = normal[a, a]
        if pivot < _PIVOT * n:
            return 0.0, 0.0, 0
        for b in range(a):
            share = normal[b, a] / pivot
            for c in range(a):
                normal[b, c] -= share * normal[a, c]
            normal[b, 6] -= share * normal[a, 6]
            normal[b, 7] -= share * normal[a, 7]
    if normal[0, 0] < _PIVOT * n:
        return 0.0, 0.0, 0
    return (
        reference[i, 0] + normal[0, 6] / normal[0, 0],
        reference[i, 1] + normal[0, 7] / normal[0, 0],
        n,
    )


@njit(**COMPILED)
def local_position(
    i: Any, reference: Any, near: Any, pitch: Any, points: Any, match: Any, trusted: Any
) -> Any:
    """Return where the motion of its trusted neighbours puts marker i, and their number or 0."""
    x, y, n = local_quadratic(i, reference, near, pitch, points, match, trusted)
    if n > 0:
        return x, y, n
    return local_affine(i, reference, near, points, match, trusted)
