"""Compiled sub-pixel centres of dots near given places. Import only where they run: numba.

Each dot is weighed on the picture itself, in an elliptic window around the present estimate,
against a plane of light fitted to a ring around it. The weight of a pixel rises from 0 to 1
between two shares of the dot's own darkness, so that noise on the bare gel and inside the dot
does not move the centre; the window follows the centre until it rests, which keeps it unbiased.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from gelslim_force.darkness_kernel import COMPILED

CX, CY, AREA, CONTRAST, MXX, MXY, MYY, STEPS, INSIDE, SKEW = range(10)
"""Columns of a weighed dot; INSIDE is the share of the window within the picture."""


@njit(**COMPILED)
def _window(mxx: Any, mxy: Any, myy: Any, factor: Any, margin: Any) -> Any:
    """Inverse shape (a, b, c) of the ellipse with semi-axes factor * axis + margin, and its box.

    A filled ellipse of semi-axis s has the second moment s^2 / 4 along it.
    """
    middle = 0.5 * (mxx + myy)
    spread = math.sqrt(0.25 * (mxx - myy) ** 2 + mxy * mxy)
    long = factor * 2.0 * math.sqrt(middle + spread) + margin
    short = factor * 2.0 * math.sqrt(max(middle - spread, 0.05)) + margin
    turn = 0.5 * math.atan2(2 * mxy, mxx - myy)
    c, s = math.cos(turn), math.sin(turn)
    p, q = 1 / (long * long), 1 / (short * short)
    box_x = math.sqrt((long * c) ** 2 + (short * s) ** 2)
    box_y = math.sqrt((long * s) ** 2 + (short * c) ** 2)
    return p * c * c + q * s * s, (p - q) * c * s, p * s * s + q * c * c, box_x, box_y


@njit(**COMPILED)
def _value(image: Any, y: Any, x: Any) -> Any:
    if image.shape[2] == 3:
        return float(image[y, x, 0]) + float(image[y, x, 1]) + float(image[y, x, 2])
    return float(image[y, x, 0])


@njit(**COMPILED)
def _light_plane(image: Any, x0: Any, y0: Any, inner: Any, outer: Any, plane: Any) -> Any:
    """Fit level and slopes of the light to the ring between two ellipses; False if too few.

    Two rounds drop what is far from the fit: other dots, glare.
    """
    height, width, _ = image.shape
    box_x, box_y = outer[3], outer[4]
    left, right = max(0, math.ceil(x0 - box_x)), min(width - 1, math.floor(x0 + box_x))
    top, bottom = max(0, math.ceil(y0 - box_y)), min(height - 1, math.floor(y0 + box_y))
    low, high = -1e30, 1e30
    plane[0], plane[1], plane[2] = 0.0, 0.0, 0.0
    for attempt in range(3):
        n = sx = sy = sxx = sxy = syy = sv = sxv = syv = svv = 0.0
        for y in range(top, bottom + 1):
            v = y - y0
            for x in range(left, right + 1):
                u = x - x0
                if outer[0] * u * u + 2 * outer[1] * u * v + outer[2] * v * v > 1.0:
                    continue
                if inner[0] * u * u + 2 * inner[1] * u * v + inner[2] * v * v < 1.0:
                    continue
                value = _value(image, y, x)
                off = value - plane[0] - plane[1] * u - plane[2] * v
                if off < low or off > high:
                    continue
                n += 1
                sx += u
                sy += v
                sxx += u * u
                sxy += u * v
                syy += v * v
                sv += value
                sxv += u * value
                syv += v * value
                svv += off * off
        if n < 8:
            return False
        if attempt == 0:
            # Level first: slopes fitted through a neighbour's dark rim would tilt the plane.
            plane[0] = sv / n
            scatter = math.sqrt(max(svv / n - plane[0] * plane[0], 0.0))
            low, high = -0.7 * scatter, 1.5 * scatter
            continue
        mx, my, mv = sx / n, sy / n, sv / n
        axx, axy, ayy = sxx / n - mx * mx, sxy / n - mx * my, syy / n - my * my
        bx, by = sxv / n - mx * mv, syv / n - my * mv
        det = axx * ayy - axy * axy
        if det > 0.02 * axx * ayy and axx > 0 and ayy > 0:
            plane[1] = (bx * ayy - by * axy) / det
            plane[2] = (by * axx - bx * axy) / det
        plane[0] = mv - plane[1] * mx - plane[2] * my
        scatter = math.sqrt(max(svv / n, 1e-6))
        low, high = -2.5 * scatter, 2.5 * scatter
    return plane[0] > 0


@njit(**COMPILED)
def weigh(image: Any, starts: Any, moments: Any, low: Any, high: Any, most: Any, out: Any) -> None:
    """Write the dots (n, 10) found from `starts` (n, 2) px with `moments` (n, 3) px².

    `image` (h, w, c) uint8; `low` and `high` are the shares of a dot's darkness between which
    the weight rises; at most `most` moves of the window. A dot that is not found has area 0.
    """
    plane = np.zeros(3)
    for i in range(starts.shape[0]):
        _weigh_one(image, starts[i], moments[i], low, high, most, plane, out[i])


@njit(**COMPILED)
def _weigh_one(
    image: Any, start: Any, moment: Any, low: Any, high: Any, most: Any, plane: Any, out: Any
) -> None:
    height, width, _ = image.shape
    x0, y0 = start[0], start[1]
    mxx, mxy, myy = moment[0], moment[1], moment[2]
    contrast = 0.0
    out[:] = 0.0
    out[CX], out[CY] = x0, y0
    for step in range(most):
        window = _window(mxx, mxy, myy, 1.25, 1.5)
        if step < 3:
            inner = _window(mxx, mxy, myy, 1.35, 1.5)
            outer = _window(mxx, mxy, myy, 1.7, 3.5)
            shift_x, shift_y = x0, y0
            if not _light_plane(image, x0, y0, inner, outer, plane):
                out[AREA] = 0.0
                return
        left, right = math.ceil(x0 - window[3]), math.floor(x0 + window[3])
        top, bottom = math.ceil(y0 - window[4]), math.floor(y0 + window[4])
        mass = square = 0.0
        area = sx = sy = sxx = sxy = syy = 0.0
        seen = all_of = 0.0
        from_, to = low * contrast, high * contrast
        for y in range(top, bottom + 1):
            v = y - y0
            for x in range(left, right + 1):
                u = x - x0
                if window[0] * u * u + 2 * window[1] * u * v + window[2] * v * v > 1.0:
                    continue
                all_of += 1
                if x < 0 or y < 0 or x >= width or y >= height:
                    continue
                seen += 1
                ground = plane[0] + plane[1] * (x - shift_x) + plane[2] * (y - shift_y)
                d = 1.0 - _value(image, y, x) / max(ground, 1.0)
                if d > 0:
                    mass += d
                    square += d * d
                w = d if step == 0 else (d - from_) / (to - from_)
                w = min(max(w, 0.0), 1.0)
                area += w
                sx += w * u
                sy += w * v
                sxx += w * u * u
                sxy += w * u * v
                syy += w * v * v
        if area < 1.0 or mass <= 0:
            out[AREA] = 0.0
            return
        contrast = square / mass
        dx, dy = sx / area, sy / area
        x0 += dx
        y0 += dy
        if x0 < 0 or y0 < 0 or x0 > width - 1 or y0 > height - 1:
            out[AREA] = 0.0
            return
        if step > 0:
            mxx = 0.5 * (mxx + max(sxx / area - dx * dx, 0.25))
            mxy = 0.5 * (mxy + sxy / area - dx * dy)
            myy = 0.5 * (myy + max(syy / area - dy * dy, 0.25))
        out[CX], out[CY], out[AREA], out[CONTRAST] = x0, y0, area, contrast
        out[MXX], out[MXY], out[MYY] = mxx, mxy, myy
        out[STEPS], out[INSIDE] = step + 1, seen / max(all_of, 1.0)
        out[SKEW] = math.sqrt(dx * dx + dy * dy)
        if step >= 3 and dx * dx + dy * dy < 1e-6:
            return
