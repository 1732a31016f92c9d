"""Compiled sub-pixel centres of dots near given positions.

Import it only where it runs, because it loads numba. The centre of a dot is a weighted centroid
of the picture in an elliptic window around the present estimate. Darkness is measured against the
light on the bare gel, a plane fitted to a ring around the window. The weight of a pixel rises from
0 to 1 between two shares of the dot's darkness, so that noise on the bare gel and inside the dot
does not move the centre. The window follows the centre until it converges, which avoids a bias.

The ring's place and moments are rounded, so that it does not depend on where the search began:
searches of the same dot from different starts fit the same light and converge to the same centre.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from gelslim_core.kernel_cache import drop_stale
from gelslim_force.detection.ring_kernel import (
    SUMS,
    ring_light,
    ring_pixels,
    ring_sums,
)
from gelslim_force.detection.window_kernel import (
    COMPILED,
    LANES,
    QUANTITIES,
    SU,
    SUU,
    SUV,
    SV,
    SVV,
    WEIGHT,
    ellipse,
    window_contrast,
    window_sums,
)

drop_stale(["centroid_kernel"], ["ring_kernel", "window_kernel"], Path(__file__).parent)

CX, CY, AREA, CONTRAST, MXX, MXY, MYY, STEPS, INSIDE, SHIFT = range(10)
"""Columns of a dot; INSIDE is 1 if the window is inside the picture, SHIFT is the last shift of the
window in px."""

_WINDOW, _WINDOW_MARGIN_PX = 1.1, 1.5
"""Semi-axes of the window: a factor of the dot's, and a margin."""
_RING, _RING_MARGIN_PX = (1.35, 1.7), (1.5, 3.5)
"""The same for the inner and the outer rim of the ring."""
_LEAST_RING = 8
_MOST_FITS = 4
"""Number of rings to which the light is fitted; a dot whose ring still changes keeps the last."""
_QUICK_UPDATES = 1
"""Number of times that the window takes the size of what it holds at once, after which the ring no
longer changes. A dot has its size then; a window in a shadow grows slowly."""
_STEPS_OF_MOMENTS = 2.0
"""Rounded moments have this many steps between a power of two and the next."""
_LEAST_MOMENT_PX2 = 0.25
_CENTRED_PX2 = 0.01
_CONVERGED_PX2 = 1e-8
_CONVERGED_SHAPE = 0.04
"""Relative change of the second moments of a converged window."""


@njit(**COMPILED)
def _light_plane(picture: Any, width: Any, ring: Any, plane: Any, work: Any) -> Any:
    """Fit level and slopes of the light to the ring around a dot (x, y, mxx, mxy, myy).

    Returns False if the ring has too few pixels. The level is fitted first, because the dark edge
    of a neighbour would tilt the plane; each further round leaves out pixels far from the last fit,
    such as other dots and glare.
    """
    most, u, v, steps, light, listed, limits, lanes = work
    if listed[0] != ring[2] or listed[1] != ring[3] or listed[2] != ring[4]:
        inner = ellipse(ring[2], ring[3], ring[4], _RING[0], _RING_MARGIN_PX[0])
        outer = ellipse(ring[2], ring[3], ring[4], _RING[1], _RING_MARGIN_PX[1])
        listed[0], listed[1], listed[2] = ring[2], ring[3], ring[4]
        listed[3] = ring_pixels(inner, outer, most, picture.shape[1], u, v, steps)
        listed[4] = max(outer[3], outer[4])
    count, reach = int(listed[3]), listed[4]
    count, n, total, squares = ring_light(
        picture, width, ring[0], ring[1], reach, u, v, steps, count, light
    )
    if n < _LEAST_RING:
        return False
    plane[0], plane[1], plane[2] = total / n, 0.0, 0.0
    scatter = math.sqrt(max(squares / n - plane[0] ** 2, 1e-6))
    limits[0], limits[1] = -0.7 * scatter, 1.5 * scatter
    for _ in range(2):
        n, su, sv, suu, suv, svv, so, suo, svo, soo = ring_sums(
            u, v, light, count, plane, limits, lanes
        )
        if n < _LEAST_RING:
            return False
        mu, mv, mo = su / n, sv / n, so / n
        auu, auv, avv = suu / n - mu * mu, suv / n - mu * mv, svv / n - mv * mv
        bu, bv = suo / n - mu * mo, svo / n - mv * mo
        det = auu * avv - auv * auv
        du = dv = 0.0
        if auu > 0 and avv > 0 and det > 0.02 * auu * avv:
            du = (bu * avv - bv * auv) / det
            dv = (bv * auu - bu * auv) / det
        plane[1] += du
        plane[2] += dv
        plane[0] += mo - du * mu - dv * mv
        scatter = math.sqrt(max(soo / n, 1e-6))
        limits[0], limits[1] = -2.5 * scatter, 2.5 * scatter
    return plane[0] > 0


@njit(**COMPILED)
def _rounded_ring(x0: Any, y0: Any, moments: Any) -> Any:
    """A dot's place in whole pixels, and its moments in steps of a quarter to a half of them."""
    mxx, mxy, myy = moments[0], moments[1], moments[2]
    step = 2.0 ** math.floor(math.log2(max(mxx, myy, _LEAST_MOMENT_PX2))) / _STEPS_OF_MOMENTS
    return (
        math.floor(x0 + 0.5),
        math.floor(y0 + 0.5),
        max(step * math.floor(mxx / step + 0.5), step),
        step * math.floor(mxy / step + 0.5),
        max(step * math.floor(myy / step + 0.5), step),
    )


@njit(**COMPILED)
def _contrast(picture: Any, width: Any, ring: Any, work: Any) -> Any:
    """Fit the light to the ring around a dot and return the dot's contrast in it; 0 without light.

    The contrast is the mean darkness, weighted by darkness.
    """
    plane, _, lanes, of_ring = work
    if not _light_plane(picture, width, ring, plane, of_ring):
        return 0.0
    window = ellipse(ring[2], ring[3], ring[4], _WINDOW, _WINDOW_MARGIN_PX)
    light = (plane[0], plane[1], plane[2])
    return window_contrast(picture, width, ring[0], ring[1], window, light, lanes)


@njit(**COMPILED)
def _grown(moments: Any, sums: Any, dx: Any, dy: Any, part: Any) -> Any:
    """Move second moments (3,) by a part of the way to those of the window's weights, in place.

    Returns the relative change of their trace.
    """
    area, before = sums[WEIGHT], moments[0] + moments[2]
    moments[0] += part * (max(sums[SUU] / area - dx * dx, _LEAST_MOMENT_PX2) - moments[0])
    moments[1] += part * (sums[SUV] / area - dx * dy - moments[1])
    moments[2] += part * (max(sums[SVV] / area - dy * dy, _LEAST_MOMENT_PX2) - moments[2])
    return abs(moments[0] + moments[2] - before) / before


@njit(**COMPILED)
def _longest(moments: Any) -> Any:
    """Second moment along the longer axis."""
    half = 0.5 * (moments[0] - moments[2])
    return 0.5 * (moments[0] + moments[2]) + math.sqrt(half * half + moments[1] * moments[1])


@njit(**COMPILED)
def _measure_one(
    picture: Any, width: Any, start: Any, limits: Any, low: Any, high: Any, work: Any, out: Any
) -> Any:
    """Write one dot found from a start (x, y, moments (3,)) and return whether it was found.

    The moments are changed. `limits` holds the largest second moment, the least contrast and the
    number of steps.
    """
    plane, sums, lanes, _ = work
    x0, y0, moments = start
    widest, faintest, most = limits
    updates, fits, ring, contrast = 0, 0, (-1.0, -1.0, 0.0, 0.0, 0.0), 0.0
    for step in range(most):
        wanted = _rounded_ring(x0, y0, moments)
        if wanted != ring and updates <= _QUICK_UPDATES and fits < _MOST_FITS:
            ring = wanted
            fits += 1
            contrast = _contrast(picture, width, ring, work)
            if contrast <= 0 or contrast < faintest:
                return False
        light = (
            plane[0] + plane[1] * (x0 - ring[0]) + plane[2] * (y0 - ring[1]),
            plane[1],
            plane[2],
        )
        window = ellipse(moments[0], moments[1], moments[2], _WINDOW, _WINDOW_MARGIN_PX)
        least, whole = low * contrast, high * contrast
        window_sums(picture, width, x0, y0, window, light, least, whole, lanes, sums)
        if sums[WEIGHT] < 1.0:
            return False
        out[INSIDE] = (
            x0 - window[3] > -0.5
            and y0 - window[4] > -0.5
            and x0 + window[3] < width - 0.5
            and y0 + window[4] < picture.shape[0] - 0.5
        )
        dx, dy = sums[SU] / sums[WEIGHT], sums[SV] / sums[WEIGHT]
        x0, y0, shift2 = x0 + dx, y0 + dy, dx * dx + dy * dy
        if x0 < 0 or y0 < 0 or x0 > width - 1 or y0 > picture.shape[0] - 1:
            return False
        grown = 1.0
        if step > 1 or shift2 < _CENTRED_PX2:
            # A window that is not centred yet may reach into a neighbour on one side.
            part = 1.0 if updates < _QUICK_UPDATES else 0.5
            grown = _grown(moments, sums, dx, dy, part)
            updates += 1
        if _longest(moments) > widest:
            return False
        out[CX], out[CY], out[AREA], out[CONTRAST] = x0, y0, sums[WEIGHT], contrast
        out[MXX], out[MXY], out[MYY] = moments[0], moments[1], moments[2]
        out[STEPS], out[SHIFT] = step + 1, math.sqrt(shift2)
        settled = updates > _QUICK_UPDATES or fits == _MOST_FITS
        settled = settled or _rounded_ring(x0, y0, moments) == ring
        if settled and shift2 < _CONVERGED_PX2 and grown < _CONVERGED_SHAPE:
            break
    return True


@njit(**COMPILED)
def _ring_work(moments: Any, widest: Any, shape: Any) -> Any:
    """Work space for the rings of dots with moments up to those given (n, 3) or `widest` px²."""
    largest = max(widest, 1.0)
    for i in range(len(moments)):
        if math.isfinite(moments[i, 0] + moments[i, 1] + moments[i, 2]):
            largest = max(largest, moments[i, 0], moments[i, 2], abs(moments[i, 1]))
    # Rounding and a long axis that is oblique make moments along an axis 2.5 times as large.
    reach = 2 * _RING[1] * math.sqrt(2.5 * largest) + _RING_MARGIN_PX[1]
    most = int(min(reach, float(max(shape[0], shape[1]))))
    size = (2 * most + 1) ** 2 + LANES
    u, v = np.empty(size, dtype=np.float32), np.empty(size, dtype=np.float32)
    steps, light = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int32)
    lanes = np.empty(SUMS * LANES, dtype=np.float32)
    return most, u, v, steps, light, np.zeros(5), np.empty(2), lanes


@njit(**COMPILED)
def measure(
    picture: Any,
    width: Any,
    starts: Any,
    moments: Any,
    widest: Any,
    faintest: Any,
    low: Any,
    high: Any,
    most: Any,
    out: Any,
) -> None:
    """Write the dots (n, 10) found from `starts` (n, 2) px with `moments` (n, 3) px².

    A start outside the picture, or one that is not finite, finds nothing.

    `picture` is as in `window_kernel`, and has `width` columns that count. A search is given up
    where the second moment along the longer axis exceeds `widest` px² or the contrast is below
    `faintest`; the window is shifted `most` times at most. `low` and `high` are the shares of a
    dot's darkness between which the weight rises. A dot that is not found has area 0.
    """
    lanes = np.empty(QUANTITIES * LANES, dtype=np.float32)
    work = np.empty(3), np.empty(6), lanes, _ring_work(moments, widest, picture.shape)
    limits, moment = (widest, faintest, most), np.empty(3)
    for i in range(starts.shape[0]):
        out[i] = 0.0
        x0, y0 = starts[i, 0], starts[i, 1]
        out[i, CX], out[i, CY] = x0, y0
        known = x0 >= 0 and y0 >= 0 and x0 <= width - 1 and y0 <= picture.shape[0] - 1
        known = known and math.isfinite(moments[i, 0] + moments[i, 1] + moments[i, 2])
        moment[0], moment[1], moment[2] = moments[i, 0], moments[i, 1], moments[i, 2]
        start = (x0, y0, moment)
        if not known or not _measure_one(picture, width, start, limits, low, high, work, out[i]):
            out[i, AREA] = 0.0
