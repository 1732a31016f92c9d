"""Compiled reading of compliance columns, without copies of whole columns."""

from __future__ import annotations

from typing import Any

from numba import njit


@njit(cache=True)
def gather_block(rows: Any, nodes: Any, block: Any) -> None:
    """block (3n, 3n) = C among `nodes`, made symmetric, from rows (c, 3, c, 3)."""
    n = len(nodes)
    for i in range(n):
        for a in range(3):
            for j in range(n):
                for b in range(3):
                    block[3 * i + a, 3 * j + b] = rows[nodes[i], a, nodes[j], b]
    for i in range(3 * n):
        for j in range(i):
            mean = 0.5 * (block[i, j] + block[j, i])
            block[i, j] = mean
            block[j, i] = mean


@njit(cache=True, fastmath=True)
def add_motion(rows: Any, nodes: Any, force: Any, motion: Any) -> None:
    """motion (3c,) += C force (n, 3) on `nodes`; nodes without force cost nothing."""
    for i in range(len(nodes)):
        for a in range(3):
            f = force[i, a]
            if f != 0.0:
                row = rows[nodes[i], a]
                for k in range(len(motion)):
                    motion[k] += f * row[k]
