"""Compiled search for the next face on a ray. Importing this module loads numba.

A line crosses an edge whose ends are on different sides of it. The side follows from the sign of
one number per corner, which is the same for both edges that meet there, so that no ray passes
between them. Distances are compared with a tolerance only to find a corner that rounding missed.

These functions are compiled into `trace_kernel`; `gelslim_core.kernel_cache` removes its cached
code when this file has changed.
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from gelslim_optics.light.trace_geometry import BONDED, CIRCLE, CORNER_PART, GEL_ONLY, PRESENCE

AIR = 0
NOTHING = -1
FAR = 1e300
# Without reference counting of arrays the search is almost 3 times faster; it allocates nothing.
COMPILED = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "_nrt": False,
}
INLINED = {**COMPILED, "forceinline": True}
MISSED = (0, 0.0, False, 0.0, False)
"""What `crossings` returns for a line that does not cross the edge."""


@njit(**INLINED)
def crossings(
    shape: Any, facts: Any, e: int, last: int, y: float, z: float, dy: float, dz: float
) -> Any:
    """Crossings of the line with edge e: count, then (t, left to right) of first and last."""
    ay, az, by, bz = shape[e, 0] - y, shape[e, 1] - z, shape[e, 2] - y, shape[e, 3] - z
    ca, cb = dy * az - dz * ay, dy * bz - dz * by
    apart = (ca >= 0) != (cb >= 0)
    sense = shape[e, 7]
    if sense == 0.0:
        if not apart or e == last:
            return MISSED
        t = (ay * (bz - az) - az * (by - ay)) / (cb - ca)
        return 1, t, cb > ca, t, cb > ca
    my, mz, r = y - shape[e, 4], z - shape[e, 5], shape[e, 6]
    s2 = dy * dy + dz * dz
    along, off = my * dy + mz * dz, dy * mz - dz * my
    leaves = sense > 0
    if not apart:
        # Two crossings or none: the point of the line nearest to the centre decides.
        if off * off >= s2 * r * r:
            return MISSED
        side = (by - ay) * (along * dz + s2 * az) - (bz - az) * (along * dy + s2 * ay)
        if side * sense <= 0:
            return MISSED
    if last >= 0 and facts[last, CIRCLE] == facts[e, CIRCLE]:
        # The ray starts on this circle; only the other root is new.
        t = -2 * along / s2
        if t <= 0 or (apart and leaves != (cb > ca)):
            return MISSED
        return 1, t, leaves, t, leaves
    # The discriminant as a product, because the difference loses digits near a tangent.
    span = math.sqrt(s2) * r
    root = math.sqrt(max((span - abs(off)) * (span + abs(off)), 0.0))
    first, second = (-root - along) / s2, (root - along) / s2
    if not apart:
        return 2, first, not leaves, second, leaves
    if leaves == (cb > ca):
        return 1, second, leaves, second, leaves
    return 1, first, not leaves, first, not leaves


@njit(**INLINED)
def side_medium(facts: Any, box: Any, gel: int, e: int, right: bool, x: float) -> int:
    """Medium on one side of an edge at x; outside the gel the bonded face meets air."""
    medium = facts[e, 1 if right else 0]
    if facts[e, PRESENCE] == BONDED and medium == gel and (x < box[2] or x > box[3]):
        return AIR
    return medium


@njit(**INLINED)
def edge_normal(shape: Any, e: int, y: float, z: float) -> Any:
    """Unit normal (y, z) to the right of an edge at a point on it."""
    if shape[e, 7] == 0.0:
        return shape[e, 4], shape[e, 5]
    size = shape[e, 7] * shape[e, 6]
    return (y - shape[e, 4]) / size, (z - shape[e, 5]) / size


@njit(**COMPILED)
def corner_exit(
    shape: Any,
    facts: Any,
    near: Any,
    corner_mm: float,
    medium: int,
    last: int,
    y: float,
    z: float,
    dy: float,
    dz: float,
) -> Any:
    """The other face at the corner where the ray is, if it leaves there: (edge, left to right).

    A ray that starts at a corner may pass both of its faces on the outside.
    """
    found, found_way, steepest = NOTHING, False, 0.0
    for k in range(near[medium, 0]):
        e = near[medium, 1 + k]
        if e == last:
            continue
        at_start = max(abs(shape[e, 0] - y), abs(shape[e, 1] - z)) <= corner_mm
        at_end = max(abs(shape[e, 2] - y), abs(shape[e, 3] - z)) <= corner_mm
        if not (at_start or at_end):
            continue
        ny, nz = edge_normal(shape, e, y, z)
        outward = dy * ny + dz * nz
        way = facts[e, 0] == medium
        if not way:
            outward = -outward
        if outward > steepest:
            found, found_way, steepest = e, way, outward
    return found, found_way


@njit(**INLINED)
def next_edge(
    shape: Any,
    facts: Any,
    near: Any,
    coats: Any,
    box: Any,
    gel: int,
    medium: int,
    last: int,
    x: float,
    y: float,
    z: float,
    dx: float,
    dy: float,
    dz: float,
) -> Any:
    """Edge where the ray leaves its medium: (edge, t, left to right, 0 | 1 corner | 2 lost)."""
    out, out_t, out_way = NOTHING, FAR, False
    back, back_t, back_way = NOTHING, -FAR, False
    wrong_t = FAR
    for k in range(near[medium, 0]):
        e = near[medium, 1 + k]
        count, t, way, t2, way2 = crossings(shape, facts, e, last, y, z, dy, dz)
        for i in range(count):
            if i == 1:
                t, way = t2, way2
            at = x + t * dx
            if medium == AIR:
                if at < box[0] or at > box[1]:
                    continue
                if facts[e, PRESENCE] == GEL_ONLY and (at < box[2] or at > box[3]):
                    continue
            before = (
                side_medium(facts, box, gel, e, not way, at)
                if medium == AIR
                else facts[e, 1 - int(way)]
            )
            if before == medium or (medium == AIR and coats[before, 0] > 0.0):
                if t >= 0:
                    if t < out_t:
                        out, out_t, out_way = e, t, way
                elif t > back_t:
                    back, back_t, back_way = e, t, way
            elif 0 < t < wrong_t:
                wrong_t = t
    if out_t < wrong_t:
        return out, out_t, out_way, 0
    if wrong_t == FAR and medium == AIR:
        return NOTHING, FAR, False, 0
    # The nearest face is met from its wrong side: rounding moved the ray past a corner. Either a
    # reentrant corner is ahead, or the ray is at a corner, or it runs along a face.
    if out != NOTHING and out_t - wrong_t <= box[4]:
        return out, out_t, out_way, 1
    if back_t > -box[4]:
        return back, 0.0, back_way, 1
    e, way = corner_exit(shape, facts, near, box[4], medium, last, y, z, dy, dz)
    if e != NOTHING:
        return e, 0.0, way, 1
    if out != NOTHING or medium == AIR:
        runs_along = False
        if last >= 0:
            ny, nz = edge_normal(shape, last, y, z)
            runs_along = abs(dy * ny + dz * nz) <= CORNER_PART
        if wrong_t <= box[4] or runs_along:
            return out, out_t, out_way, 1
    return NOTHING, FAR, False, 2


@njit(**COMPILED)
def gel_plane(
    shape: Any,
    facts: Any,
    near: Any,
    box: Any,
    gel: int,
    last: int,
    x: float,
    y: float,
    z: float,
    dx: float,
    dy: float,
    dz: float,
) -> float:
    """Distance at which a ray in air enters an end face of the gel; FAR if it does not."""
    if dx > 0 and x < box[2]:
        t = (box[2] - x) / dx
    elif dx < 0 and x > box[3]:
        t = (box[3] - x) / dx
    else:
        return FAR
    nearest, inside = FAR, False
    for k in range(near[gel, 0]):
        e = near[gel, 1 + k]
        count, ta, way_a, tb, way_b = crossings(shape, facts, e, last, y, z, dy, dz)
        for i in range(count):
            s, way = (ta, way_a) if i == 0 else (tb, way_b)
            if t < s < nearest:
                nearest, inside = s, facts[e, 1 - int(way)] == gel
    return t if inside else FAR
