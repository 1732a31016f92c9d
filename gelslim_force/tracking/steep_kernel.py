"""Compiled matching of markers at the edge of a contact, by elimination.

Import it only where it runs, because it loads numba. At the edge of a contact the motion changes
by a third of a pitch from marker to marker. A fit to the neighbours then predicts no dot within
the tolerance that excludes errors of a whole pitch. But the only free dot near a marker belongs
to it if the vectors to its neighbours have changed little. Arrays as in `matching_kernel`.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from gelslim_core.kernel_cache import drop_stale
from gelslim_force.detection.darkness_kernel import COMPILED
from gelslim_force.tracking.matching_kernel import local_position

drop_stale(["steep_kernel"], ["matching_kernel"], Path(__file__).parent)

_DIRECT = 4
"""The first four neighbours are one site away along an axis."""
_DISTANCE_RATIO = 1.8
_VARIATION_FACTOR = 1.5
_ROUNDS = 6


@njit(**COMPILED)
def match_by_elimination(
    reference: Any,
    near: Any,
    pitch: Any,
    points: Any,
    match: Any,
    trusted: Any,
    gate: Any,
    strain: Any,
) -> Any:
    """Match markers to the only free dot near their predicted position; return their number.

    The dot must be within `gate` pitches and within 1.5 times the variation of the neighbours'
    motion, and the next free dot must be 1.8 times as far away. At least two direct neighbours
    must be trusted, and the vector to each may change by the share `strain` of its length.
    """
    n, m = reference.shape[0], points.shape[0]
    free = np.ones(m, dtype=np.bool_)
    for i in range(n):
        if trusted[i]:
            free[match[i]] = False
    matched = 0
    for _ in range(_ROUNDS):
        added = 0
        offer = np.full(n, -1, dtype=np.int64)
        gaps = np.full(n, 1e300)
        for i in range(n):
            if trusted[i]:
                continue
            x, y, support = local_position(i, reference, near, pitch, points, match, trusted)
            if support < 4:
                continue
            k, gap, other = _nearest_free(points, free, x, y)
            if k < 0 or gap > gate * pitch[i] or other < _DISTANCE_RATIO * gap:
                continue
            if gap > _VARIATION_FACTOR * _variation(i, reference, near, points, match, trusted):
                continue
            if _keeps_vectors(i, k, reference, near, points, match, trusted, strain):
                offer[i], gaps[i] = k, gap / pitch[i]
        for i in range(n):
            if offer[i] < 0:
                continue
            first = True
            for j in range(n):
                if j != i and offer[j] == offer[i] and (gaps[j], j) < (gaps[i], i):
                    first = False
            if first:
                match[i] = offer[i]
                added += 1
        for i in range(n):
            if offer[i] >= 0 and match[i] == offer[i] and not trusted[i] and free[match[i]]:
                trusted[i] = True
                free[match[i]] = False
        matched += added
        if added == 0:
            break
    return matched


@njit(**COMPILED)
def _variation(i: Any, reference: Any, near: Any, points: Any, match: Any, trusted: Any) -> Any:
    """Return the largest difference in px of a trusted neighbour's motion from their mean."""
    n = 0
    mx = my = 0.0
    for k in range(near.shape[1]):
        j = near[i, k]
        if j >= 0 and trusted[j]:
            n += 1
            mx += points[match[j], 0] - reference[j, 0]
            my += points[match[j], 1] - reference[j, 1]
    most = 0.0
    for k in range(near.shape[1]):
        j = near[i, k]
        if j >= 0 and trusted[j]:
            dx = points[match[j], 0] - reference[j, 0] - mx / n
            dy = points[match[j], 1] - reference[j, 1] - my / n
            most = max(most, dx * dx + dy * dy)
    return math.sqrt(most)


@njit(**COMPILED)
def _nearest_free(points: Any, free: Any, x: Any, y: Any) -> Any:
    """Return the nearest free dot, its distance, and the distance of the next one."""
    best, least, second = -1, 1e300, 1e300
    for k in range(points.shape[0]):
        if not free[k]:
            continue
        gap = (points[k, 0] - x) ** 2 + (points[k, 1] - y) ** 2
        if gap < least:
            best, least, second = k, gap, least
        elif gap < second:
            second = gap
    return best, math.sqrt(least), math.sqrt(second)


@njit(**COMPILED)
def _keeps_vectors(
    i: Any, k: Any, reference: Any, near: Any, points: Any, match: Any, trusted: Any, strain: Any
) -> Any:
    """Return whether dot k changes the vectors from marker i to its neighbours only a little."""
    seen = 0
    for side in range(_DIRECT):
        j = near[i, side]
        if j < 0 or not trusted[j]:
            continue
        u = reference[i, 0] - reference[j, 0]
        v = reference[i, 1] - reference[j, 1]
        du = points[k, 0] - points[match[j], 0] - u
        dv = points[k, 1] - points[match[j], 1] - v
        if du * du + dv * dv > strain * strain * (u * u + v * v):
            return False
        seen += 1
    return seen >= 2
