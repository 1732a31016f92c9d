"""Compiled outlines of dots and their exact area coverage. Imported where used (numba).

The covered area of a pixel follows from the edges of the polygon alone: in every row of pixels that
an edge crosses, it adds its signed height to all pixels right of it and a trapezium to the pixels
that it passes through. The centroid of a dot is therefore exact to rounding.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def _add_span(acc: Any, row: Any, xa: Any, xb: Any, rise: Any) -> None:
    """Add a piece of edge within one pixel row, from xa to xb, that rises by `rise`."""
    first, last = math.floor(xa), math.floor(xb)
    if first == last:
        part = 0.5 * (xa + xb) - first
        acc[row, first] += rise * (1 - part)
        acc[row, first + 1] += rise * part
        return
    step = 1 if xb > xa else -1
    per = rise / (xb - xa)
    x = xa
    column = first
    while True:
        border = column + 1 if step > 0 else column
        end = xb if column == last else float(border)
        height = per * (end - x)
        part = 0.5 * (x + end) - column
        acc[row, column] += height * (1 - part)
        acc[row, column + 1] += height * part
        if column == last:
            return
        x = end
        column += step


@njit(**COMPILED)
def _add_polygon(acc: Any, polygon: Any, left: Any, top: Any, share: Any) -> None:
    """Add the edges of `polygon` (k, 2), times `share`, to `acc` (rows, columns + 1)."""
    count = polygon.shape[0]
    for k in range(count):
        n = k + 1 if k + 1 < count else 0
        x0, y0 = polygon[k, 0] - left, polygon[k, 1] - top
        x1, y1 = polygon[n, 0] - left, polygon[n, 1] - top
        if y0 == y1:
            continue
        sign = share
        if y0 > y1:
            x0, y0, x1, y1 = x1, y1, x0, y0
            sign = -share
        lean = (x1 - x0) / (y1 - y0)
        y, x = y0, x0
        row = math.floor(y0)
        while y < y1:
            end = min(row + 1.0, y1)
            ahead = x1 if end == y1 else x0 + lean * (end - y0)
            _add_span(acc, row, x, ahead, sign * (end - y))
            y, x = end, ahead
            row += 1


@njit(**COMPILED)
def _blurred(cover: Any, taps: Any, reach: Any) -> Any:
    """Convolve `cover` along both axes with the even kernel `taps` (reach + 1,).

    The outer `reach` rows of `cover` are empty and are not read.
    """
    rows, columns = cover.shape
    across = np.zeros((rows, columns), dtype=np.float32)
    out = np.empty((rows, columns), dtype=np.float32)
    for y in range(reach, rows - reach):
        line, row = across[y], cover[y]
        for x in range(columns):
            line[x] = np.float32(taps[0] * row[x])
        for r in range(1, reach + 1):
            tap = np.float32(taps[r])
            for x in range(r, columns - r):
                line[x] += tap * np.float32(row[x + r] + row[x - r])
            for x in range(min(r, columns - r)):
                line[x] += tap * np.float32(row[x + r])
                line[columns - 1 - x] += tap * np.float32(row[columns - 1 - x - r])
    first, last = reach, rows - reach - 1
    for y in range(rows):
        line = out[y]
        line[:] = 0
        for k in range(max(first, y - reach), min(last, y + reach) + 1):
            tap = np.float32(taps[abs(k - y)])
            for x in range(columns):
                line[x] += tap * across[k, x]
    return out


@njit(**COMPILED)
def draw_dots(
    start: Any, end: Any, drawn: Any, poses: Any, taps: Any, reach: Any, opacity: Any, ink: Any
) -> None:
    """Add the dots' coverage to `ink` (h, w) float32, at most 1.

    Outlines `start`, `end` (m, k, 2) in px, pixel centres at integers, at the exposure's begin
    and end; `poses` (m,) of the path between are averaged (midpoints). `taps` (m, t) with `reach`
    (m,): each dot's blur, reach 0 for none. `opacity` (m,) is the ink of each dot over the usual.
    """
    height, width = ink.shape
    polygon = np.empty(start.shape[1:])
    for m in range(start.shape[0]):
        if not drawn[m]:
            continue
        spare = reach[m] + 1
        low_x = high_x = start[m, 0, 0]
        low_y = high_y = start[m, 0, 1]
        for k in range(start.shape[1]):
            low_x = min(low_x, start[m, k, 0], end[m, k, 0])
            high_x = max(high_x, start[m, k, 0], end[m, k, 0])
            low_y = min(low_y, start[m, k, 1], end[m, k, 1])
            high_y = max(high_y, start[m, k, 1], end[m, k, 1])
        if high_x < -spare or high_y < -spare or low_x > width + spare or low_y > height + spare:
            continue
        left, top = math.floor(low_x + 0.5) - spare, math.floor(low_y + 0.5) - spare
        columns = math.floor(high_x + 0.5) - left + spare + 1
        rows = math.floor(high_y + 0.5) - top + spare + 1
        acc = np.zeros((rows, columns + 1))
        doubled = 0.0
        for k in range(start.shape[1]):
            n = k + 1 if k + 1 < start.shape[1] else 0
            doubled += end[m, k, 0] * end[m, n, 1] - end[m, n, 0] * end[m, k, 1]
        share = (-1.0 if doubled > 0 else 1.0) / poses[m]
        for pose in range(poses[m]):
            t = (pose + 0.5) / poses[m]
            for k in range(polygon.shape[0]):
                polygon[k, 0] = start[m, k, 0] + t * (end[m, k, 0] - start[m, k, 0]) + 0.5
                polygon[k, 1] = start[m, k, 1] + t * (end[m, k, 1] - start[m, k, 1]) + 0.5
            _add_polygon(acc, polygon, left, top, share)
        for y in range(rows):
            running = 0.0
            for x in range(columns):
                running += acc[y, x]
                acc[y, x] = running
        patch = acc[:, :columns].astype(np.float32)
        if reach[m] > 0:
            patch = _blurred(patch, taps[m], reach[m])
        for y in range(max(0, -top), min(rows, height - top)):
            for x in range(max(0, -left), min(columns, width - left)):
                at = ink[y + top, x + left] + opacity[m] * patch[y, x]
                ink[y + top, x + left] = min(at, np.float32(1.0))


@njit(**COMPILED)
def expand(points: Any, weights: Any, out: Any) -> None:
    """Write corners (m, c, 2) as `weights` (c, k) of rim points (m, k, 2)."""
    rims, count = points.shape[0], points.shape[1]
    for m in range(rims):
        for c in range(weights.shape[0]):
            u = v = 0.0
            for k in range(count):
                u += weights[c, k] * points[m, k, 0]
                v += weights[c, k] * points[m, k, 1]
            out[m, c, 0], out[m, c, 1] = u, v


@njit(**COMPILED)
def moments(outlines: Any, centres: Any, area: Any) -> None:
    """Write area centroids (m, 2) and signed areas (m,) of outlines (m, k, 2) (Green's theorem)."""
    count = outlines.shape[1]
    for m in range(outlines.shape[0]):
        u, v = outlines[m, 0, 0], outlines[m, 0, 1]
        doubled = x = y = ax = ay = 0.0
        for k in range(1, count + 1):
            n = k if k < count else 0
            bx, by = outlines[m, n, 0] - u, outlines[m, n, 1] - v
            cross = ax * by - bx * ay
            doubled += cross
            x += (ax + bx) * cross
            y += (ay + by) * cross
            ax, ay = bx, by
        area[m] = doubled / 2
        centres[m, 0], centres[m, 1] = u + x / (3 * doubled), v + y / (3 * doubled)


@njit(**COMPILED)
def within(outlines: Any, width: Any, height: Any, found: Any) -> None:
    """Write whether (m,) all corners (m, k, 2) lie in the picture, pixel centres at integers."""
    for m in range(outlines.shape[0]):
        inside = True
        for k in range(outlines.shape[1]):
            x, y = outlines[m, k, 0], outlines[m, k, 1]
            inside &= -0.5 <= x <= width - 0.5 and -0.5 <= y <= height - 0.5
        found[m] = inside
