"""Compiled low-pass of a force field. Import it only where it runs, because it loads numba."""

from __future__ import annotations

from typing import Any

from numba import njit


@njit(cache=True, nogil=True, error_model="numpy")
def spread_out(starts: Any, columns: Any, weights: Any, force: Any, found: Any) -> Any:
    """Write `force` (c, 3) after the low-pass with CSR rows `starts`, `columns`, `weights`.

    Returns the squares of what it takes off the tangential and the normal forces.
    """
    tangential = normal = 0.0
    for node in range(len(force)):
        x = y = z = 0.0
        for k in range(starts[node], starts[node + 1]):
            other, weight = columns[k], weights[k]
            x += weight * force[other, 0]
            y += weight * force[other, 1]
            z += weight * force[other, 2]
        found[node, 0], found[node, 1], found[node, 2] = x, y, z
        tangential += (force[node, 0] - x) ** 2 + (force[node, 1] - y) ** 2
        normal += (force[node, 2] - z) ** 2
    return tangential, normal
