"""Compiled distances in boolean pictures. Import this module only where they run (numba)."""

from __future__ import annotations

from typing import Any

from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True}
FAR = 1 << 30


@njit(**COMPILED)
def city_block(picture: Any, outside: Any, distance: Any) -> None:
    """Steps along rows and columns to the nearest true place, by two passes.

    Args:
        picture: (rows, columns).
        outside: Whether all that lies outside counts as true.
        distance: Receives (rows, columns); `FAR` where nothing is true.
    """
    rows, columns = picture.shape
    edge = 0 if outside else FAR
    for i in range(rows):
        for j in range(columns):
            above = distance[i - 1, j] if i > 0 else edge
            before = distance[i, j - 1] if j > 0 else edge
            distance[i, j] = 0 if picture[i, j] else min(FAR, above + 1, before + 1)
    for i in range(rows - 1, -1, -1):
        for j in range(columns - 1, -1, -1):
            below = distance[i + 1, j] if i < rows - 1 else edge
            after = distance[i, j + 1] if j < columns - 1 else edge
            distance[i, j] = min(distance[i, j], below + 1, after + 1)
