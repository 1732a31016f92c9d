"""Compiled model of flat punches with several outlines. Import only where it runs: numba."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def punches(compliance: Any, extra: Any, shares: Any, profiles: Any, least: Any, out: Any) -> None:
    """Write the stiffness of `k` punches, and the force that the profile removes, (k, 2) to `out`.

    `compliance` (n, n) is that among the nodes around them. A punch loads the `shares` (k, n) of
    each node's area; a share under `least` counts as none. A node's own compliance increases by
    `extra` times 1/√share - 1. `profiles` (k, n) are the heights of the indenter's surface, not
    finite where the indenter ends.
    """
    for p in range(len(shares)):
        nodes = np.flatnonzero((shares[p] > least) & np.isfinite(profiles[p]))
        out[p] = 0.0
        count = len(nodes)
        if count == 0:
            continue
        block = np.empty((count, count))
        for i in range(count):
            for j in range(count):
                block[i, j] = compliance[nodes[i], nodes[j]]
            block[i, i] += extra * (1 / np.sqrt(shares[p, nodes[i]]) - 1)
        lower = np.linalg.cholesky(block)
        # 1ᵀ C⁻¹ 1 and 1ᵀ C⁻¹ profile need one triangular solve each.
        ones, heights = np.empty(count), np.empty(count)
        for i in range(count):
            a, b = 1.0, profiles[p, nodes[i]]
            for j in range(i):
                a -= lower[i, j] * ones[j]
                b -= lower[i, j] * heights[j]
            ones[i], heights[i] = a / lower[i, i], b / lower[i, i]
        out[p, 0] = ones @ ones
        out[p, 1] = ones @ heights
