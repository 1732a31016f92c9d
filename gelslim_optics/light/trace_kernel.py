"""The compiled loop over rays. Importing this module loads numba."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from gelslim_optics.light.trace_crossing import (
    AIR,
    COMPILED,
    INLINED,
    NOTHING,
    edge_normal,
    gel_plane,
    next_edge,
    side_medium,
)
from gelslim_optics.light.trace_face import (
    MIX_A,
    STEP,
    fresnel,
    map_arrival,
    scramble,
    turn_back,
    uniform,
)
from gelslim_optics.light.trace_geometry import (
    ABSORBED,
    CORNERS,
    CROSSINGS,
    END,
    ENDS,
    ENDS_STOPPED,
    ENTERED_GEL,
    EXIT,
    FOOT_REFLECTION,
    GEL_END,
    GEL_ENDS,
    LOST,
    MISSED,
    OWNER,
    PER_EDGE,
    PRESENCE,
    TRUNCATED,
)


@njit(**COMPILED)
def trace_block(
    shape: Any,
    facts: Any,
    near: Any,
    coats: Any,
    box: Any,
    marks: Any,
    index: Any,
    absorption: Any,
    starts: Any,
    medium: int,
    first_edge: int,
    key: Any,
    first_ray: int,
    limits: Any,
    ray: Any,
    stack: Any,
    notes: Any,
    seeds: Any,
    sums: Any,
    heat: Any,
    fans: Any,
    trail: Any,
) -> int:
    """Trace rays (n, 8) into `sums`, `heat`, `fans`; returns the rows written to `trail`.

    `limits`: smallest weight that is split at a face, weight at which a ray ends, largest number
    of faces. `ray` (7), `stack` (d, 7), `notes` (d, 4) and `seeds` (d) are work space. The rows of
    `trail` are ray, branch, x, y, z; none are written where it is empty.
    """
    split, cut, max_faces = limits[0], limits[1], int(limits[2])
    depth = stack.shape[0]
    edges = (sums.shape[0] - PER_EDGE) // 3
    leaked, stopped, returned = PER_EDGE, PER_EDGE + edges, PER_EDGE + 2 * edges
    outside, gel, face = marks[0], marks[1], marks[2]
    written = 0
    for r in range(starts.shape[0]):
        sums[FOOT_REFLECTION] += starts[r, 7]
        if starts[r, 6] == 0.0:
            sums[MISSED] += 1.0 - starts[r, 7]
            continue
        top, branch = 1, -1
        for i in range(7):
            stack[0, i] = starts[r, i]
        notes[0, 0], notes[0, 1], notes[0, 2], notes[0, 3] = first_edge, medium, first_edge, 0
        seeds[0] = scramble(key + STEP * np.uint64(first_ray + r + 1))
        while top > 0:
            top -= 1
            branch += 1
            for i in range(7):
                ray[i] = stack[top, i]
            last, now, left, bounce = notes[top, 0], notes[top, 1], notes[top, 2], notes[top, 3]
            path = seeds[top]
            written = note(trail, written, r, branch, ray)
            while True:
                w = ray[6]
                if w < cut or bounce >= max_faces:
                    sums[TRUNCATED] += w
                    break
                bounce += 1
                sums[CROSSINGS] += 1.0
                e, t, way, trouble, plane = face_ahead(
                    shape, facts, near, coats, box, gel, now, last, ray
                )
                if trouble == 2:
                    sums[LOST] += w
                    break
                sums[CORNERS] += trouble
                if e == NOTHING:
                    add_leak(sums, left, leaked, facts, w)
                    break
                for i in range(3):
                    ray[i] += t * ray[3 + i]
                if e < 0:
                    ray[0] = plane
                written = note(trail, written, r, branch, ray)
                if absorption[now] > 0.0:
                    w *= math.exp(-absorption[now] * t)
                    sums[ABSORBED] += ray[6] - w
                    ray[6] = w
                at_end = e == END or (e == GEL_END and (plane == box[0] or plane == box[1]))
                beyond = medium_behind(facts, box, outside, gel, e, way, now, at_end, ray[0])
                normal = normal_along(shape, e, way, ray)
                cosine = max(ray[3] * normal[0] + ray[4] * normal[1] + ray[5] * normal[2], 0.0)
                if now == AIR and e >= 0 and is_blocked(facts, coats, box, gel, e, way, ray[0]):
                    add_leak(sums, left, leaked, facts, w)
                    break
                if coats[beyond, 0] > 0.0:
                    if e >= 0 and facts[e, OWNER] == face:
                        map_arrival(
                            shape, box, e, ray, w, cosine, normal[1], normal[2], sums, heat, fans
                        )
                    kept = w * turn_back(coats, beyond, ray, path, bounce, normal, cosine)
                    if e in (END, GEL_END):
                        sums[ENDS_STOPPED] += w - kept
                    else:
                        sums[stopped + facts[e, OWNER]] += w - kept
                    ray[6] = kept
                    last = e
                    if kept == 0.0:
                        break
                    continue
                back, behind = fresnel(index[now], index[beyond], cosine)
                into = transmitted(w, back, split, top >= depth - 1, path, bounce)
                reflected = w - into
                if e >= 0 and facts[e, PRESENCE] == 1:
                    sums[ENTERED_GEL] += into if beyond == gel else (-into if now == gel else 0.0)
                if beyond == AIR and at_end:
                    sums[ENDS if e == END else GEL_ENDS] += into
                    into = 0.0
                elif e >= 0 and facts[e, EXIT] == 1 and beyond == AIR:
                    sums[returned + facts[e, OWNER]] += into
                    into = 0.0
                if into > 0.0:
                    if reflected > 0.0:
                        for i in range(6):
                            stack[top, i] = ray[i]
                        stack[top, 6] = reflected
                        reflect(stack[top], normal, cosine)
                        notes[top, 0], notes[top, 1] = e, now
                        notes[top, 2], notes[top, 3] = left, bounce
                        seeds[top] = scramble((path ^ MIX_A) + STEP * np.uint64(bounce))
                        top += 1
                    ratio = index[now] / index[beyond]
                    turn = behind - ratio * cosine
                    for i in range(3):
                        ray[3 + i] = ratio * ray[3 + i] + turn * normal[i]
                    if beyond == AIR and now != AIR:
                        left = e
                    now = beyond
                    ray[6] = into
                elif reflected > 0.0:
                    reflect(ray, normal, cosine)
                    ray[6] = reflected
                else:
                    break
                last = e
                to_unit_length(ray)
    return written


@njit(**COMPILED)
def note(trail: Any, written: int, ray_number: int, branch: int, ray: Any) -> int:
    """Write a point of the path of a ray where there is room."""
    if written < trail.shape[0]:
        trail[written, 0] = ray_number
        trail[written, 1] = branch
        for i in range(3):
            trail[written, 2 + i] = ray[i]
        written += 1
    return written


@njit(**COMPILED)
def add_leak(sums: Any, left: int, leaked: int, facts: Any, w: float) -> None:
    """Add flux that left the guide, by the face through which it last left a solid."""
    if left >= 0:
        sums[leaked + facts[left, OWNER]] += w
    elif left == GEL_END:
        sums[GEL_ENDS] += w
    else:
        sums[LOST] += w


@njit(**INLINED)
def face_ahead(
    shape: Any, facts: Any, near: Any, coats: Any, box: Any, gel: int, now: int, last: int, ray: Any
) -> Any:
    """The next face on a ray in the medium `now`.

    Returns:
        The edge, or `END`, `GEL_END` or `NOTHING`; the distance; whether the ray crosses the edge
        from left to right; 0, 1 where a corner was met, or 2 where the ray is lost; and x of the
        plane in which the ray ends a solid.
    """
    x, dx = ray[0], ray[3]
    e, t, way, trouble = next_edge(
        shape, facts, near, coats, box, gel, now, last, x, ray[1], ray[2], dx, ray[4], ray[5]
    )
    plane = 0.0
    if now == AIR:
        t_end = gel_plane(shape, facts, near, box, gel, last, x, ray[1], ray[2], dx, ray[4], ray[5])
        if t_end < t:
            e, t, trouble = GEL_END, t_end, 0
            plane = box[2] if dx > 0 else box[3]
    elif dx != 0.0:
        side = (2 if now == gel else 0) + (1 if dx > 0 else 0)
        plane = box[side]
        t_end = max((plane - x) / dx, 0.0)
        if t_end < t:
            e, t, trouble = GEL_END if now == gel else END, t_end, 0
    return e, t, way, trouble, plane


@njit(**INLINED)
def medium_behind(
    facts: Any,
    box: Any,
    outside: int,
    gel: int,
    e: int,
    way: bool,
    now: int,
    at_end: bool,
    x: float,
) -> int:
    """The medium behind a face; `at_end` says that the ray leaves by an end of guide and gel."""
    if e == END or (at_end and now == gel):
        return outside
    if e == GEL_END:
        return AIR if now == gel else gel
    return side_medium(facts, box, gel, e, way, x)


@njit(**INLINED)
def normal_along(shape: Any, e: int, way: bool, ray: Any) -> Any:
    """Unit normal of a face, on the side to which the ray goes."""
    if e < 0:
        return (1.0 if ray[3] > 0 else -1.0, 0.0, 0.0)
    ny, nz = edge_normal(shape, e, ray[1], ray[2])
    return (0.0, ny, nz) if way else (0.0, -ny, -nz)


@njit(**INLINED)
def is_blocked(facts: Any, coats: Any, box: Any, gel: int, e: int, way: bool, x: float) -> bool:
    """Whether light in air meets the LED board at a foot, or the back of a coat."""
    return facts[e, EXIT] == 1 or coats[side_medium(facts, box, gel, e, not way, x), 0] > 0.0


@njit(**INLINED)
def transmitted(
    w: float, back: float, split: float, is_full: bool, path: Any, bounce: int
) -> float:
    """Weight that passes a face which reflects the part `back`; the rest is reflected.

    Where the smaller part is below `split`, or where the stack `is_full`, chance decides between
    the parts, so that the mean is right.
    """
    into = w * (1.0 - back)
    small = min(into, w - into)
    if small < split and back < 1.0 and back > 0.0:
        u = uniform(path, bounce, 0)
        if w <= split:
            return 0.0 if u < back else w
        if u * split < small:
            return split if into == small else w - split
        return 0.0 if into == small else w
    if is_full and 0.0 < into < w:
        return 0.0 if uniform(path, bounce, 0) < back else w
    return into


@njit(**INLINED)
def reflect(ray: Any, normal: Any, cosine: float) -> None:
    """Mirror the direction of a ray."""
    for i in range(3):
        ray[3 + i] -= 2 * cosine * normal[i]


@njit(**INLINED)
def to_unit_length(ray: Any) -> None:
    """A Newton step of the direction to unit length, so that rounding does not accumulate."""
    scale = 1.5 - 0.5 * (ray[3] ** 2 + ray[4] ** 2 + ray[5] ** 2)
    for i in range(3):
        ray[3 + i] *= scale
