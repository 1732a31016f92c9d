"""Compiled access to compliance columns, without copies of whole columns."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

TILE = 16


@njit(cache=True)
def gather_block(rows: Any, nodes: Any, block: Any, kept: int) -> None:
    """block (3n, 3n) = C among `nodes` from rows (c, 3, c, 3), symmetric.

    The first `kept` nodes' part is there already. The lower half is the upper one's image, in
    tiles, so that neither is read nor written across memory.
    """
    n = len(nodes)
    for i0 in range(0, n, TILE):
        i1 = min(n, i0 + TILE)
        for j0 in range(i0, n, TILE):
            j1 = min(n, j0 + TILE)
            if j1 <= kept:
                continue
            for i in range(i0, i1):
                for a in range(3):
                    for j in range(max(i, j0), j1):
                        for b in range(a if i == j else 0, 3):
                            value = rows[nodes[i], a, nodes[j], b]
                            block[3 * i + a, 3 * j + b] = value
                            block[3 * j + b, 3 * i + a] = value


# No reordering of sums: a kernel compiled here and one from the cache need not agree on it.
@njit(cache=True, fastmath={"contract", "nsz"})
def add_motion(rows: Any, nodes: Any, force: Any, starts: Any, ends: Any, motion: Any) -> None:
    """motion (3c,) += C force (n, 3) on `nodes`, between `starts` and `ends` (r,) only.

    Nodes without force cost nothing.
    """
    pushed, count = np.empty(len(nodes), dtype=np.intp), 0
    for i in range(len(nodes)):
        if force[i, 0] != 0.0 or force[i, 1] != 0.0 or force[i, 2] != 0.0:
            pushed[count] = i
            count += 1
    # Two nodes at once, so that the motion is read and written half as often.
    for pair in range(0, count - 1, 2):
        i, j = pushed[pair], pushed[pair + 1]
        x, y, z = force[i, 0], force[i, 1], force[i, 2]
        p, q, r = force[j, 0], force[j, 1], force[j, 2]
        row, next_row = rows[nodes[i]], rows[nodes[j]]
        for run in range(len(starts)):
            for k in range(starts[run], ends[run]):
                motion[k] += (x * row[0, k] + y * row[1, k] + z * row[2, k]) + (
                    p * next_row[0, k] + q * next_row[1, k] + r * next_row[2, k]
                )
    if count % 2:
        i = pushed[count - 1]
        x, y, z = force[i, 0], force[i, 1], force[i, 2]
        row = rows[nodes[i]]
        for run in range(len(starts)):
            for k in range(starts[run], ends[run]):
                motion[k] += x * row[0, k] + y * row[1, k] + z * row[2, k]
