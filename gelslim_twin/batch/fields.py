"""Fields of many poses on the host, and parts of a batch that fit into memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BLOCK_NUMBERS = 9
"""Numbers per pair of candidates in the largest array."""
FIELD_NUMBERS = 12
"""Numbers per surface node in the largest array."""


@dataclass(frozen=True, eq=False)
class Overlaps:
    """What of a tool is below the undeformed surface, at n poses.

    Attributes:
        nodes: Surface nodes (n,) that it covers.
        depth_mm: The largest depth (n,).
        depths_mm: Sum (n,) of the depths at the nodes.
        span_mm: The larger (n,) of the extents of these nodes along x and y.
        candidates: About how many nodes (n,) the solver takes into account.
    """

    nodes: NDArray[np.intp]
    depth_mm: Array
    depths_mm: Array
    span_mm: Array
    candidates: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class SolvedContacts:
    """Fields of n poses over the c surface nodes.

    Attributes:
        force_n: Nodal forces (n, c, 3).
        displacement_mm: Displacements (n, c, 3).
        touch: Contact status (n, c), values of `ContactStatus`.
        solved: Whether (n,) the pose converged; the fields of one that did not are 0.
    """

    force_n: Array
    displacement_mm: Array
    touch: NDArray[np.int8]
    solved: NDArray[np.bool_]

    def put(self, at: NDArray[np.intp], part: SolvedContacts) -> None:
        """Set the poses `at` (k,)."""
        self.force_n[at], self.displacement_mm[at] = part.force_n, part.displacement_mm
        self.touch[at], self.solved[at] = part.touch, part.solved


def memory_parts(candidates: NDArray[np.intp], nodes: int, most_bytes: int) -> list[slice]:
    """Parts of poses, in order of their candidates, whose arrays fit into memory."""
    found, first = [], 0
    for last in range(1, len(candidates) + 1):
        more = int(candidates[last]) if last < len(candidates) else 0
        size = 8 * (last + 1 - first) * max(BLOCK_NUMBERS * more**2, FIELD_NUMBERS * nodes)
        if last == len(candidates) or size > most_bytes:
            found.append(slice(first, last))
            first = last
    return found
