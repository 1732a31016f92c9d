"""Compiled judgement of measured dots: which of them can be dots, and which of them are lost.

Import it only where it runs, because it loads numba. Dots (n, 10) have the columns of
`centroid_kernel`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from gelslim_force.detection.centroid_kernel import (
    AREA,
    CONTRAST,
    CX,
    CY,
    INSIDE,
    MXX,
    MXY,
    MYY,
    SHIFT,
)
from gelslim_force.detection.darkness_kernel import COMPILED

_LEAST_AREA = 0.6
"""Area of a dot, at least, over that of a disc of the smallest diameter."""
_LEAST_FILL = 0.57
"""Area of a dot, at least, over that of the ellipse with its second moments."""
_SAME_PX = 1.0


@njit(**COMPILED)
def plausible(
    dots: Any, least_contrast: Any, smallest: Any, largest: Any, aspect: Any, keep: Any
) -> None:
    """Write to `keep` (n,) which dots have the contrast, size and shape of a dot.

    `smallest` and `largest` are diameters in px, `aspect` is the largest ratio of the semi-axes.
    """
    least = _LEAST_AREA * math.pi / 4 * smallest**2
    for i in range(len(dots)):
        dot = dots[i]
        middle = (dot[MXX] + dot[MYY]) / 2
        spread = math.hypot((dot[MXX] - dot[MYY]) / 2, dot[MXY])
        long, short = 2 * math.sqrt(middle + spread), 2 * math.sqrt(max(middle - spread, 0.0))
        keep[i] = (
            dot[AREA] > 0
            and dot[AREA] >= max(least, _LEAST_FILL * math.pi * long * short)
            and dot[CONTRAST] >= least_contrast
            and 2 * long <= largest
            and long <= aspect * max(short, 0.5)
        )


@njit(**COMPILED)
def own_flags(
    dots: Any, least_fill: Any, least_shift: Any, border: Any, odd: Any, restless: Any, flags: Any
) -> None:
    """Write flags (n,) of what is unusual about each found dot by itself: it is cut by the border,
    fills less than `least_fill` of its ellipse, or moved by more than `least_shift` px at last."""
    for i in range(len(dots)):
        dot = dots[i]
        flags[i] = 0
        if dot[AREA] > 0:
            ellipse = 4 * math.pi * math.sqrt(max(dot[MXX] * dot[MYY] - dot[MXY] ** 2, 0.0))
            flags[i] |= odd if dot[AREA] < least_fill * ellipse else 0
            flags[i] |= border if dot[INSIDE] < 1.0 else 0
            flags[i] |= restless if dot[SHIFT] > least_shift else 0


@njit(**COMPILED)
def discard_lost(dots: Any, starts: Any, moments: Any, keep: Any) -> None:
    """Set to 0 what was found from predictions (n, 2) and is no dot or not the one predicted.

    `keep` (n,) tells which dots are plausible. A dot may be as far from its prediction as its
    radius by its `moments` (n, 3) before, and a little more. If two predictions lead to one dot,
    the nearer one has it.
    """
    n = len(dots)
    moved, x, y = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        x[i], y[i] = dots[i, CX], dots[i, CY]
        moved[i] = math.sqrt((x[i] - starts[i, 0]) ** 2 + (y[i] - starts[i, 1]) ** 2)
        most = max(abs(moments[i, 0]), abs(moments[i, 1]), abs(moments[i, 2]))
        keep[i] = keep[i] and moved[i] <= 2.0 * math.sqrt(most) + 1.5
    lost = ~keep
    for i in range(n):
        near = 0
        for j in range(i):
            near += (x[j] - x[i]) ** 2 + (y[j] - y[i]) ** 2 <= _SAME_PX**2
        for j in range(i if near > 0 and keep[i] else 0):
            if keep[j] and (x[j] - x[i]) ** 2 + (y[j] - y[i]) ** 2 <= _SAME_PX**2:
                lost[i if moved[i] >= moved[j] else j] = True
    for i in range(n):
        if lost[i]:
            dots[i, AREA:] = 0.0
