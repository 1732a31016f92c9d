"""Compiled medians of few values. Import it only where it runs, because it loads numba.

`np.median` takes five to ten times as long for some hundred values.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from gelslim_force.detection.darkness_kernel import COMPILED


@njit(**COMPILED)
def median(values: Any) -> float:
    """Median of the values (n,) that are not NaN; NaN without such a value."""
    return float(np.nanmedian(values))


@njit(**COMPILED)
def line_medians(values: Any, lines: Any, fewest: Any, found: Any) -> None:
    """Write the lower medians (lines, m) of values (n, m) in each line of markers.

    `lines` (lines, markers of a line) are indices, -1 for none. Lines of which fewer than `fewest`
    values are known have the median NaN.
    """
    ranked = np.empty(lines.shape[1])
    for line in range(len(lines)):
        for axis in range(values.shape[1]):
            count = 0
            for k in range(lines.shape[1]):
                value = values[lines[line, k], axis] if lines[line, k] >= 0 else math.nan
                if not math.isnan(value):
                    at = count
                    while at > 0 and ranked[at - 1] > value:
                        ranked[at] = ranked[at - 1]
                        at -= 1
                    ranked[at] = value
                    count += 1
            found[line, axis] = ranked[(count - 1) // 2] if count >= fewest else math.nan
