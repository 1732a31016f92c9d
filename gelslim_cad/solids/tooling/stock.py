"""Choice of sheets from stock."""

from __future__ import annotations

import math
from collections.abc import Sequence


def plate_stock(stock_mm: Sequence[float], least_mm: float) -> tuple[float, int]:
    """Thickness of the sheet for a plate of at least `least_mm`, and how many to stack.

    The thinnest sheet that is thick enough is taken, or else several of the thickest.
    """
    alone = [s for s in stock_mm if s >= least_mm - 1e-9]
    if alone:
        return min(alone), 1
    thickest = max(stock_mm)
    return thickest, math.ceil(least_mm / thickest - 1e-9)
