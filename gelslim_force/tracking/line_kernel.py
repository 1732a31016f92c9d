"""Compiled look at the rows and columns of a picture. Import it only where it runs (numba).

`lines` (s, n) int16 are n rows or columns of a picture: the sums of the colours at s places along
each. Lines lie beside each other, so that the compiler can take several at once.
`left` and `top` are where the lines begin in the picture.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from gelslim_force.detection.darkness_kernel import COMPILED

PARTS = 8
"""Parts of a line, of which most must be sharp."""
_SOME = 8
"""Places after which lines are looked at that are still equal."""


@njit(**COMPILED)
def rows(planes: Any, left: Any, top: Any, step: Any, lines: Any) -> None:
    """Write every `step`-th pixel of the rows of a picture (h, w, c)."""
    coloured = planes.shape[2] == 3
    for i in range(lines.shape[1]):
        row = planes[top + i]
        for k in range(lines.shape[0]):
            x = left + k * step
            lines[k, i] = np.int16(row[x, 0])
            if coloured:
                lines[k, i] += np.int16(row[x, 1]) + np.int16(row[x, 2])


@njit(**COMPILED)
def columns(planes: Any, left: Any, top: Any, step: Any, lines: Any) -> None:
    """Write every `step`-th pixel of the columns of a picture (h, w, c)."""
    count = lines.shape[1]
    for k in range(lines.shape[0]):
        row = planes[top + k * step, left : left + count]
        if planes.shape[2] == 3:
            for i in range(count):
                lines[k, i] = np.uint16(row[i, 0]) + np.uint16(row[i, 1]) + np.uint16(row[i, 2])
        else:
            for i in range(count):
                lines[k, i] = row[i, 0]


@njit(**COMPILED)
def longest_run(lines: Any) -> int:
    """Number of equal lines one after the other."""
    differ = np.zeros(lines.shape[1] - 1, dtype=np.int16)
    for k in range(lines.shape[0]):
        place = lines[k]
        for i in range(len(differ)):
            differ[i] |= place[i + 1] ^ place[i]
        # In most pictures a few places tell all lines apart.
        if k % _SOME == _SOME - 1 and differ.all():
            return 1
    longest = run = 1
    for i in range(len(differ)):
        run = run + 1 if differ[i] == 0 else 1
        longest = max(longest, run)
    return longest


@njit(**COMPILED)
def sharpness(lines: Any, sharp: Any) -> None:
    """Write how sharp each inner line (n - 3,) is: the bend of the grey values across it.

    The bend is summed over parts of the line; all parts but two are at least as sharp.
    """
    length, count = lines.shape[0] // PARTS, len(sharp)
    least, second = np.empty(count, dtype=np.int32), np.empty(count, dtype=np.int32)
    total = np.empty(count, dtype=np.int32)
    least[:] = second[:] = sharp[:] = np.iinfo(np.int32).max
    for part in range(PARTS):
        total[:] = 0
        for k in range(part * length, (part + 1) * length):
            place = lines[k]
            for i in range(count):
                rise = np.int32(place[i + 2]) - np.int32(place[i + 1])
                bend = np.int32(3) * rise + np.int32(place[i]) - np.int32(place[i + 3])
                total[i] += np.int32(abs(bend))
        for i in range(count):
            now = total[i]
            sharp[i] = min(sharp[i], max(second[i], now))
            second[i] = min(second[i], max(least[i], now))
            least[i] = min(least[i], now)
