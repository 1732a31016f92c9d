"""Compiled sub-pixel centres of dots near given positions.

Import it only where it runs, because it loads numba. The centre of a dot is a weighted centroid
of the picture in an elliptic window around the present estimate. Darkness is measured against the
light on the bare gel, a plane fitted to a ring around the window. The weight of a pixel rises from
0 to 1 between two shares of the dot's darkness, so that noise on the bare gel and inside the dot
does not move the centre. The window follows the centre until it converges, which avoids a bias.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

CX, CY, AREA, CONTRAST, MXX, MXY, MYY, STEPS, INSIDE, SHIFT = range(10)
"""Columns of a dot; INSIDE is 1 if the window is inside the picture, SHIFT is the last shift of the
window in px."""

# Sums are not reordered: with full fastmath, cached code had another order than new code.
COMPILED: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "nsz"},
}
_FITS = 2
"""Number of windows for which the light is fitted; later windows have hardly moved."""
_MARGIN_PX = 3
_CONVERGED_PX2 = 4e-6
_CONVERGED_SHAPE = 0.04
"""Relative change of the second moments of a converged window."""


@njit(**COMPILED)
def _ellipse(mxx: Any, mxy: Any, myy: Any, factor: Any, margin: Any) -> Any:
    """Ellipse a u^2 + 2 b u v + c v^2 <= 1 of semi-axes factor * axis + margin, and its half box.

    Returns (a, b, c, box_x, box_y). A filled ellipse has the second moment axis^2 / 4.
    """
    middle = 0.5 * (mxx + myy)
    spread = math.sqrt(0.25 * (mxx - myy) ** 2 + mxy * mxy)
    long = factor * 2.0 * math.sqrt(middle + spread) + margin
    short = factor * 2.0 * math.sqrt(max(middle - spread, 0.05)) + margin
    cos2, sin2 = 1.0, 0.0
    if spread > 0:
        cos2, sin2 = 0.5 * (mxx - myy) / spread, mxy / spread
    mean, half = 0.5 * (1 / long**2 + 1 / short**2), 0.5 * (1 / long**2 - 1 / short**2)
    mean2, half2 = 0.5 * (long**2 + short**2), 0.5 * (long**2 - short**2)
    box_x, box_y = math.sqrt(mean2 + half2 * cos2), math.sqrt(mean2 - half2 * cos2)
    return mean + half * cos2, half * sin2, mean - half * cos2, box_x, box_y


@njit(**COMPILED)
def _chord(shape: Any, v: Any) -> Any:
    """First and last u (float) of the ellipse at height v; first > last if it has none there."""
    b = shape[1] * v
    root = b * b - shape[0] * (shape[2] * v * v - 1.0)
    if root < 0:
        return 1.0, -1.0
    root = math.sqrt(root)
    return (-b - root) / shape[0], (-b + root) / shape[0]


@njit(**COMPILED)
def _copy(image: Any, left: Any, top: Any, patch: Any) -> None:
    """Sum the channels of the box at (left, top) of the picture into `patch` (h, w)."""
    if image.shape[2] == 3:
        for y in range(patch.shape[0]):
            for x in range(patch.shape[1]):
                patch[y, x] = (
                    np.float32(image[top + y, left + x, 0])
                    + np.float32(image[top + y, left + x, 1])
                    + np.float32(image[top + y, left + x, 2])
                )
    else:
        for y in range(patch.shape[0]):
            for x in range(patch.shape[1]):
                patch[y, x] = image[top + y, left + x, 0]


@njit(**COMPILED)
def _ring_part(
    row: Any, first: Any, last: Any, start: Any, level: Any, slope: Any, low: Any, high: Any
) -> Any:
    """Sums over pixels first ... last of a row that deviate by low ... high from the light."""
    one, zero = np.float32(1), np.float32(0)
    n = su = suu = sv = suv = svv = zero
    rise, base = np.float32(slope), np.float32(level)
    for x in range(first, last + 1):
        u = np.float32(x) - np.float32(start)
        off = row[x] - base - rise * u
        keep = one if (off > low) & (off < high) else zero
        n += keep
        su += keep * u
        suu += keep * u * u
        sv += keep * off
        suv += keep * u * off
        svv += keep * off * off
    return n, su, suu, sv, suv, svv


@njit(**COMPILED)
def _light_plane(
    patch: Any, x0: Any, y0: Any, inner: Any, outer: Any, plane: Any, rounds: Any, limits: Any
) -> Any:
    """Fit level and slopes of the light to the ring between two ellipses.

    Returns False if the ring has too few pixels. (x0, y0) is the centre in the patch. Each round
    leaves out pixels far from the last fit, such as other dots and glare. `limits` holds the
    bounds for the next call.
    """
    height, width = patch.shape
    top = max(0, math.ceil(y0 - outer[4]))
    bottom = min(height - 1, math.floor(y0 + outer[4]))
    for _ in range(rounds):
        low, high = np.float32(limits[0]), np.float32(limits[1])
        n = su = suu = sy = suy = syy = sv = suv = syv = svv = 0.0
        for y in range(top, bottom + 1):
            v = y - y0
            first, last = _chord(outer, v)
            if first > last:
                continue
            a, b = max(0, math.ceil(x0 + first)), min(width - 1, math.floor(x0 + last))
            first, last = _chord(inner, v)
            base = plane[0] + plane[2] * v
            for side in range(2):
                if first > last:
                    if side == 1:
                        break
                    i, j = a, b
                elif side == 0:
                    i, j = a, min(b, math.ceil(x0 + first) - 1)
                else:
                    i, j = max(a, math.floor(x0 + last) + 1), b
                if j < i:
                    continue
                part = _ring_part(patch[y], i, j, x0, base, plane[1], low, high)
                n += part[0]
                su += part[1]
                suu += part[2]
                sv += part[3]
                suv += part[4]
                svv += part[5]
                sy += part[0] * v
                suy += part[1] * v
                syy += part[0] * v * v
                syv += part[3] * v
        if n < 8:
            return False
        if limits[1] > 1e29:
            # First the level only: the dark edge of a neighbour would tilt the plane.
            plane[0] += sv / n
            scatter = math.sqrt(max(svv / n - (sv / n) ** 2, 1e-6))
            limits[0], limits[1] = -0.7 * scatter, 1.5 * scatter
            continue
        mu, my, mv = su / n, sy / n, sv / n
        auu, auy, ayy = suu / n - mu * mu, suy / n - mu * my, syy / n - my * my
        bu, by = suv / n - mu * mv, syv / n - my * mv
        det = auu * ayy - auy * auy
        du = dy = 0.0
        if auu > 0 and ayy > 0 and det > 0.02 * auu * ayy:
            du = (bu * ayy - by * auy) / det
            dy = (by * auu - bu * auy) / det
        plane[1] += du
        plane[2] += dy
        plane[0] += mv - du * mu - dy * my
        scatter = math.sqrt(max(svv / n, 1e-6))
        limits[0], limits[1] = -2.5 * scatter, 2.5 * scatter
    return plane[0] > 0


@njit(**COMPILED)
def _darken(patch: Any, x0: Any, y0: Any, plane: Any, dark: Any) -> None:
    """Write 1 - light / plane to `dark`, of the shape of `patch`."""
    slope, one = np.float32(plane[1]), np.float32(1)
    for y in range(patch.shape[0]):
        base = np.float32(plane[0] + plane[2] * (y - y0) - plane[1] * x0)
        for x in range(patch.shape[1]):
            ground = max(base + slope * np.float32(x), one)
            dark[y, x] = one - patch[y, x] / ground


@njit(**COMPILED)
def _row_sums(row: Any, first: Any, last: Any, start: Any, scale: Any, offset: Any) -> Any:
    one, zero = np.float32(1), np.float32(0)
    mass = square = area = su = suu = zero
    for x in range(first, last + 1):
        u = np.float32(x) - np.float32(start)
        d = row[x]
        positive = max(d, zero)
        mass += positive
        square += positive * positive
        w = min(max(d * scale - offset, zero), one)
        area += w
        su += w * u
        suu += w * u * u
    return mass, square, area, su, suu


@njit(**COMPILED)
def _window_sums(dark: Any, x0: Any, y0: Any, window: Any, low: Any, high: Any, sums: Any) -> None:
    """Write mass, square, area, first and second moments of the weights in the window."""
    height, width = dark.shape
    scale = np.float32(1 / (high - low))
    offset = np.float32(low / (high - low))
    sums[:] = 0.0
    for y in range(
        max(0, math.ceil(y0 - window[4])), min(height - 1, math.floor(y0 + window[4])) + 1
    ):
        v = y - y0
        first, last = _chord(window, v)
        if first > last:
            continue
        a, b = max(0, math.ceil(x0 + first)), min(width - 1, math.floor(x0 + last))
        if b < a:
            continue
        mass, square, area, su, suu = _row_sums(dark[y], a, b, x0, scale, offset)
        sums[0] += mass
        sums[1] += square
        sums[2] += area
        sums[3] += su
        sums[4] += area * v
        sums[5] += suu
        sums[6] += su * v
        sums[7] += area * v * v


@njit(**COMPILED)
def _measure_one(
    image: Any, start: Any, moment: Any, low: Any, high: Any, most: Any, out: Any
) -> Any:
    """Write one dot and return whether it was found."""
    height, width, _ = image.shape
    x0, y0 = start[0], start[1]
    mxx, mxy, myy = moment[0], moment[1], moment[2]
    plane, limits, sums = np.zeros(3), np.array([-1e30, 1e30]), np.zeros(8)
    left = top = right = bottom = 0
    patch = np.empty((0, 0), dtype=np.float32)
    dark = np.empty((0, 0), dtype=np.float32)
    contrast = 0.0
    px, py = x0, y0
    for step in range(most):
        window = _ellipse(mxx, mxy, myy, 1.1, 1.5)
        outer = _ellipse(mxx, mxy, myy, 1.7, 3.5)
        if (
            max(0, math.floor(x0 - outer[3])) < left
            or max(0, math.floor(y0 - outer[4])) < top
            or min(width - 1, math.ceil(x0 + outer[3])) > right
            or min(height - 1, math.ceil(y0 + outer[4])) > bottom
            or step == 0
        ):
            left = max(0, math.floor(x0 - outer[3]) - _MARGIN_PX)
            top = max(0, math.floor(y0 - outer[4]) - _MARGIN_PX)
            right = min(width - 1, math.ceil(x0 + outer[3]) + _MARGIN_PX)
            bottom = min(height - 1, math.ceil(y0 + outer[4]) + _MARGIN_PX)
            patch = np.empty((bottom - top + 1, right - left + 1), dtype=np.float32)
            dark = np.empty_like(patch)
            _copy(image, left, top, patch)
            if step >= _FITS:
                _darken(patch, px - left, py - top, plane, dark)
        if step < _FITS:
            inner = _ellipse(mxx, mxy, myy, 1.35, 1.5)
            plane[0] += plane[1] * (x0 - px) + plane[2] * (y0 - py)
            px, py = x0, y0
            rounds = 2 if step == 0 else 1
            if not _light_plane(patch, x0 - left, y0 - top, inner, outer, plane, rounds, limits):
                return False
            _darken(patch, x0 - left, y0 - top, plane, dark)
        if step == 0:
            _window_sums(dark, x0 - left, y0 - top, window, 0.0, 1.0, sums)
        else:
            _window_sums(dark, x0 - left, y0 - top, window, low * contrast, high * contrast, sums)
        mass, square, area = sums[0], sums[1], sums[2]
        if area < 1.0 or mass <= 0:
            return False
        contrast = square / mass
        dx, dy = sums[3] / area, sums[4] / area
        out[INSIDE] = (
            x0 - window[3] > -0.5
            and y0 - window[4] > -0.5
            and x0 + window[3] < width - 0.5
            and y0 + window[4] < height - 0.5
        )
        x0 += dx
        y0 += dy
        if x0 < 0 or y0 < 0 or x0 > width - 1 or y0 > height - 1:
            return False
        grown = 0.0
        if step > 0:
            grown = mxx + myy
            mxx = 0.5 * (mxx + max(sums[5] / area - dx * dx, 0.25))
            mxy = 0.5 * (mxy + sums[6] / area - dx * dy)
            myy = 0.5 * (myy + max(sums[7] / area - dy * dy, 0.25))
            grown = abs(mxx + myy - grown) / grown
        out[CX], out[CY], out[AREA], out[CONTRAST] = x0, y0, area, contrast
        out[MXX], out[MXY], out[MYY] = mxx, mxy, myy
        out[STEPS], out[SHIFT] = step + 1, math.sqrt(dx * dx + dy * dy)
        if step >= _FITS and dx * dx + dy * dy < _CONVERGED_PX2 and grown < _CONVERGED_SHAPE:
            break
    return True


@njit(**COMPILED)
def measure(
    image: Any, starts: Any, moments: Any, low: Any, high: Any, most: Any, out: Any
) -> None:
    """Write the dots (n, 10) found from `starts` (n, 2) px with `moments` (n, 3) px².

    `image` is (h, w, c) uint8; `low` and `high` are the shares of a dot's darkness between which
    the weight rises; the window is shifted `most` times at most. A dot that is not found has
    area 0.
    """
    for i in range(starts.shape[0]):
        out[i] = 0.0
        out[i, CX], out[i, CY] = starts[i, 0], starts[i, 1]
        if not _measure_one(image, starts[i], moments[i], low, high, most, out[i]):
            out[i, AREA] = 0.0
