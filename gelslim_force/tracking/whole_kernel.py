"""Compiled search for dots that are not seen whole. Import it only where it runs (numba).

`growth` (n,) and `stretch` (n,) are the logarithms of the size and stretch of the markers' dots
over those at rest, NaN for those not seen. `near` (n, k) are the neighbours of each marker on the
lattice, the nearest first, or -1.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from gelslim_force.detection.darkness_kernel import COMPILED

_LEAST_PRODUCT = 1e-12
_LEAST_AREA = 0.01
"""Determinant, over the squared trace, of the places from which a gradient is taken."""


@njit(**COMPILED)
def _change(now: Any, before: Any) -> Any:
    """Growth and stretch of second moments (3,) over others, by eigenvalues of now / before."""
    mixed = now[0] * before[2] + now[2] * before[0] - 2 * now[1] * before[1]
    start = before[0] * before[2] - before[1] ** 2
    product = max((now[0] * now[2] - now[1] ** 2) / start, _LEAST_PRODUCT)
    ratio = mixed / (2 * start) / math.sqrt(product)
    return math.log(product) / 2, math.acosh(max(ratio, 1.0))


@njit(**COMPILED)
def changes(dots: Any, moments: Any, rest: Any, growth: Any, stretch: Any) -> None:
    """Write growth and stretch of the `dots` (n,) of the markers, -1 for those not seen.

    `moments` (m, 3) are those of the dots, `rest` (n, 3) those to which they are compared.
    """
    for i in range(len(dots)):
        growth[i] = stretch[i] = math.nan
        if dots[i] >= 0:
            growth[i], stretch[i] = _change(moments[dots[i]], rest[i])


@njit(**COMPILED)
def strained(places: Any, motion: Any, near: Any, next_to: Any, rest: Any, found: Any) -> None:
    """Write the second moments (n, 3) that the strain of the gel gives to the dots at rest.

    The gradient of the `motion` (n, 2) about each of the `places` (n, 2) is the least squares of
    those of its `next_to` neighbours that are seen. Where they do not determine it, there is none.
    """
    for i in range(len(places)):
        count = px = py = ux = uy = 0.0
        for k in range(next_to):
            j = near[i, k]
            if j >= 0 and not math.isnan(motion[j, 0]):
                count += 1
                px += places[j, 0]
                py += places[j, 1]
                ux += motion[j, 0]
                uy += motion[j, 1]
        xx = xy = yy = ax = ay = bx = by = 0.0
        for k in range(next_to):
            j = near[i, k]
            if j >= 0 and not math.isnan(motion[j, 0]):
                x, y = places[j, 0] - px / count, places[j, 1] - py / count
                u, v = motion[j, 0] - ux / count, motion[j, 1] - uy / count
                xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
                ax, ay, bx, by = ax + x * u, ay + y * u, bx + x * v, by + y * v
        a, b, c, d = 1.0, 0.0, 0.0, 1.0
        area = xx * yy - xy * xy
        if area > _LEAST_AREA * (xx + yy) ** 2:
            a, b = 1 + (yy * ax - xy * ay) / area, (xx * ay - xy * ax) / area
            c, d = (yy * bx - xy * by) / area, 1 + (xx * by - xy * bx) / area
        mxx, mxy, myy = rest[i]
        found[i, 0] = a * a * mxx + 2 * a * b * mxy + b * b * myy
        found[i, 1] = a * c * mxx + (a * d + b * c) * mxy + b * d * myy
        found[i, 2] = c * c * mxx + 2 * c * d * mxy + d * d * myy


@njit(**COMPILED)
def strain_about(strained_moments: Any, rest: Any, near: Any, found: Any) -> None:
    """Write the largest strain (n,) at each marker and its neighbours.

    `strained_moments` (n, 3) are those that `strained` gave; the strain is the larger one of growth
    and stretch.
    """
    count = len(rest)
    own = np.empty(count)
    for i in range(count):
        growth, stretch = _change(strained_moments[i], rest[i])
        own[i] = max(abs(growth), stretch)
    for i in range(count):
        found[i] = own[i]
        for k in range(near.shape[1]):
            if near[i, k] >= 0:
                found[i] = max(found[i], own[near[i, k]])


@njit(**COMPILED)
def far_from_neighbours(growth: Any, near: Any, limits: Any, far: Any) -> None:
    """Write which dots (n,) have grown otherwise than the median of the dots around them.

    They are those that differ by more than `limits` (n,). Neighbours that are not seen, or not
    there, count as the dot itself.
    """
    count = near.shape[1]
    around = np.empty(count)
    for i in range(len(growth)):
        alike, limit = 0, limits[i]
        for k in range(count):
            value = growth[near[i, k]] if near[i, k] >= 0 else math.nan
            around[k] = growth[i] if math.isnan(value) else value
            alike += abs(growth[i] - around[k]) <= limit
        # If more than half are alike, so are the two in the middle, and their mean.
        if 2 * alike > count or math.isnan(growth[i]):
            far[i] = False
        else:
            around.sort()
            middle = (around[(count - 1) // 2] + around[count // 2]) / 2
            far[i] = abs(growth[i] - middle) > limit


@njit(**COMPILED)
def beside_lost(seen: Any, near: Any, next_to: Any, fewest: Any, beside: Any) -> None:
    """Write which markers (n,) have `fewest` or more of their `next_to` neighbours not seen."""
    for i in range(len(seen)):
        lost = 0
        for k in range(next_to):
            lost += near[i, k] >= 0 and not seen[near[i, k]]
        beside[i] = lost >= fewest


@njit(**COMPILED)
def beside_gap(whole: Any, near: Any, next_to: Any, fewest: Any, worn: Any, beside: Any) -> None:
    """Write which markers (n,) are neighbours of the inside of a gap.

    Inside are markers that are not `whole`, with at least `fewest` of the first `next_to`
    neighbours, none of them whole. Where more than a share `worn` of the markers miss their dot and
    less than half of those around it, all gaps are wear.
    """
    count = len(whole)
    inside = np.zeros(count, dtype=np.bool_)
    single = inner = 0
    for i in range(count):
        there = missing = 0
        for k in range(next_to):
            if near[i, k] >= 0:
                there += 1
                missing += not whole[near[i, k]]
        single += not whole[i] and 2 * missing < there
        inside[i] = not whole[i] and missing == there and missing >= fewest
        inner += inside[i]
    beside[:] = False
    if inner == 0 or single > worn * count:
        return
    for i in range(count):
        for k in range(near.shape[1]):
            beside[i] |= near[i, k] >= 0 and inside[near[i, k]]
