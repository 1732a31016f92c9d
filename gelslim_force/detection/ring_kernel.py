"""Compiled sums over the ring of bare gel around a dot. Import it only where it runs (numba).

The pixels of a ring follow from its ellipses alone where its centre is a whole pixel. They are
listed once for all dots of the same size, their light is read once for each dot, and the sums are
then over these few numbers, sixteen at a time, so that the compiler can use vector instructions
without changing the order of any sum.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from gelslim_force.detection.window_kernel import COMPILED, LANES

SUMS = 10
_OUTSIDE = -1
"""Light of what lies outside the picture."""


@njit(**COMPILED)
def ring_pixels(inner: Any, outer: Any, most: Any, stride: Any, u: Any, v: Any, steps: Any) -> int:
    """Write the places (u, v) of the pixels between two ellipses, from the centre.

    `steps` are the same in a picture whose rows follow each other by `stride`. The ellipses are
    those of `window_kernel`; what is further away than `most` px along an axis is left out, and
    the arrays have room for (2 most + 1)² + LANES values. The places of the last lanes, which are
    those of no pixel, are 0. Returns the number of pixels.
    """
    zero = np.float32(0)
    count: Any = 0
    right, bottom = min(math.floor(outer[3]), most), min(math.floor(outer[4]), most)
    oa, ia = np.float32(outer[0]), np.float32(inner[0])
    for y in range(-bottom, bottom + 1):
        ob, oc = np.float32(2 * outer[1] * y), np.float32(outer[2] * y * y - 1)
        ib, ic = np.float32(2 * inner[1] * y), np.float32(inner[2] * y * y - 1)
        for x in range(-right, right + 1):
            at = np.float32(x)
            u[count], v[count], steps[count] = x, y, y * stride + x
            count += ((oa * at + ob) * at + oc <= zero) & ((ia * at + ib) * at + ic > zero)
    u[count : count + LANES] = v[count : count + LANES] = zero
    return count


@njit(**COMPILED)
def ring_light(
    picture: Any,
    width: Any,
    x0: Any,
    y0: Any,
    reach: Any,
    u: Any,
    v: Any,
    steps: Any,
    count: Any,
    light: Any,
) -> Any:
    """Write the light (n,) at the pixels of a ring around a whole pixel; -1 outside the picture.

    `picture` is as in `window_kernel`, and has `width` columns that count; the ring is within
    `reach` px. Returns the number of values, rounded up to a multiple of `LANES`, the last ones
    being those of no pixel; the number of pixels in the picture, the sum of their light, and that
    of its square.
    """
    x0, y0 = int(x0), int(y0)
    n, total, squares = np.int64(0), np.int64(0), np.int64(0)
    if reach <= min(min(x0, width - 1 - x0), min(y0, picture.shape[0] - 1 - y0)):
        pixels, middle, n = picture.reshape(-1), y0 * picture.shape[1] + x0, np.int64(count)
        for k in range(count):
            value = np.int32(pixels[np.uint64(middle + steps[k])])
            light[k] = value
            total += value
            squares += np.int32(value * value)
    else:
        for k in range(count):
            x, y = x0 + int(u[k]), y0 + int(v[k])
            light[k] = _OUTSIDE
            if (x >= 0) & (y >= 0) & (x < width) & (y < picture.shape[0]):
                value = np.int32(picture[y, x])
                light[k] = value
                n += 1
                total += value
                squares += np.int32(value * value)
    while count % LANES:
        light[count] = _OUTSIDE
        count += 1
    return count, n, total, squares


@njit(**COMPILED)
def ring_sums(u: Any, v: Any, light: Any, count: Any, plane: Any, limits: Any, lanes: Any) -> Any:
    """Sums over the pixels of a ring whose light deviates by low ... high from a plane.

    Returns (number, u, v, uu, uv, vv, off, u off, v off, off²), with off the deviation from the
    plane (level, slope x, slope y) and (u, v) the place from the centre.
    """
    one, zero = np.float32(1), np.float32(0)
    level, across, down = np.float32(plane[0]), np.float32(plane[1]), np.float32(plane[2])
    low, high = np.float32(limits[0]), np.float32(limits[1])
    for i in range(SUMS * LANES):
        lanes[i] = zero
    for first in range(0, count, LANES):
        us, vs, values = u[first:], v[first:], light[first:]
        for i in range(LANES):
            x, y = us[i], vs[i]
            off = np.float32(values[i]) - level - across * x - down * y
            kept = (values[i] >= 0) & (off > low) & (off < high)
            keep, off = one if kept else zero, off if kept else zero
            kept_x, kept_y = keep * x, keep * y
            lanes[i] += keep
            lanes[LANES + i] += kept_x
            lanes[2 * LANES + i] += kept_y
            lanes[3 * LANES + i] += kept_x * x
            lanes[4 * LANES + i] += kept_x * y
            lanes[5 * LANES + i] += kept_y * y
            lanes[6 * LANES + i] += off
            lanes[7 * LANES + i] += off * x
            lanes[8 * LANES + i] += off * y
            lanes[9 * LANES + i] += off * off
    return (
        _total(lanes, 0), _total(lanes, 1), _total(lanes, 2), _total(lanes, 3), _total(lanes, 4),
        _total(lanes, 5), _total(lanes, 6), _total(lanes, 7), _total(lanes, 8), _total(lanes, 9),
    )  # fmt: skip


@njit(**COMPILED)
def _total(lanes: Any, quantity: Any) -> float:
    total = 0.0
    for i in range(LANES):
        total += lanes[quantity * LANES + i]
    return total
