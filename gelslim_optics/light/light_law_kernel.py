"""Compiled law of the light. Import this module only where it runs (numba)."""

from __future__ import annotations

import math
from typing import Any

from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def irradiance(
    slope: Any, towards: Any, ambient: Any, penumbra: Any, value: Any, by_slope: Any
) -> None:
    """Irradiance relative to the level surface, and its derivative; see `LightLaw`.

    Args:
        slope: (n, 2) slopes along x and y.
        towards: (k, n, 2) h of the sources, or (k, 1, 2) where it is the same everywhere.
        ambient: Share of the light that does not depend on the slope, (k, n) or (k, 1).
        penumbra: Width of the transition into attached shadow, likewise.
        value: Receives (k, n).
        by_slope: Receives (k, n, 2).
    """
    for k in range(len(towards)):
        for n in range(len(slope)):
            at = n if towards.shape[1] > 1 else 0
            h_x, h_y = towards[k, at, 0], towards[k, at, 1]
            wide = penumbra[k, at] * penumbra[k, at]
            x, y = slope[n, 0], slope[n, 1]
            square = 1 / (1 + x * x + y * y)
            over = (1 - ambient[k, at]) / (1 + math.sqrt(1 + wide)) * math.sqrt(square)
            lit = 1 - h_x * x - h_y * y
            smooth = math.sqrt(lit * lit + wide)
            part, steep = over * (lit + smooth), over * (1 + lit / smooth)
            value[k, n] = ambient[k, at] + part
            by_slope[k, n, 0] = -steep * h_x - part * square * x
            by_slope[k, n, 1] = -steep * h_y - part * square * y
