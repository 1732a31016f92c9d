"""Compiled law of the light. Import this module only where it runs (numba)."""

from __future__ import annotations

import math
from typing import Any

from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def irradiance(slope: Any, table: Any, places: Any, value: Any, by_slope: Any) -> None:
    """Irradiance relative to the level surface, and its derivative; see `LightLaw`.

    Args:
        slope: (m, 2) slopes along x and y.
        table: (n, k, 4) h along x and y, ambient share and penumbra of k sources at n places.
        places: (m,) numbers of the places.
        value: Receives (k, m).
        by_slope: Receives (k, m, 2).
    """
    for n in range(len(slope)):
        x, y, laws = slope[n, 0], slope[n, 1], table[places[n]]
        square = 1 / (1 + x * x + y * y)
        root = math.sqrt(square)
        for k in range(len(laws)):
            h_x, h_y, ambient, wide = laws[k, 0], laws[k, 1], laws[k, 2], laws[k, 3] * laws[k, 3]
            over = (1 - ambient) / (1 + math.sqrt(1 + wide)) * root
            lit = 1 - h_x * x - h_y * y
            smooth = math.sqrt(lit * lit + wide)
            part, steep = over * (lit + smooth), over * (1 + lit / smooth)
            value[k, n] = ambient + part
            by_slope[k, n, 0] = -steep * h_x - part * square * x
            by_slope[k, n, 1] = -steep * h_y - part * square * y
