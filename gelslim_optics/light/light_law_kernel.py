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
        towards: (k, 2) h of the sources.
        ambient: Share of the light that does not depend on the slope.
        penumbra: Width of the transition into attached shadow.
        value: Receives (k, n).
        by_slope: Receives (k, n, 2).
    """
    unit = (1 + math.sqrt(1 + penumbra * penumbra)) / 2
    direct = (1 - ambient) / (2 * unit)
    for n in range(len(slope)):
        x, y = slope[n, 0], slope[n, 1]
        square = 1 / (1 + x * x + y * y)
        over = direct * math.sqrt(square)
        for k in range(len(towards)):
            lit = 1 - towards[k, 0] * x - towards[k, 1] * y
            smooth = math.sqrt(lit * lit + penumbra * penumbra)
            part, steep = over * (lit + smooth), over * (1 + lit / smooth)
            value[k, n] = ambient + part
            by_slope[k, n, 0] = -steep * towards[k, 0] - part * square * x
            by_slope[k, n, 1] = -steep * towards[k, 1] - part * square * y
