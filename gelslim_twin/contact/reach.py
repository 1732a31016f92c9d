"""Nodes in reach of a tool, with their compliance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.compliance import SurfaceCompliance

Nodes = NDArray[np.intp]
SPARE = 1.5
"""How much larger than needed a kept block may be before a smaller one is gathered."""


@dataclass(frozen=True, eq=False)
class Reach:
    """Nodes (n,) in reach, in the order they came, and their compliance (3n, 3n)."""

    nodes: Nodes
    block: NDArray[np.float32]

    def including(self, wanted: NDArray[np.bool_], compliance: SurfaceCompliance) -> Reach:
        """One that has all `wanted` (c,) nodes, and not too many others."""
        count = int(wanted.sum())
        inside = np.zeros(len(wanted), dtype=bool)
        inside[self.nodes] = True
        new = np.flatnonzero(wanted & ~inside)
        if len(self.nodes) + len(new) > SPARE * count:
            return reach_of(wanted, compliance)
        if len(new) == 0:
            return self
        nodes = np.concatenate([self.nodes, new])
        return Reach(nodes, compliance.block(nodes, self.block))


def reach_of(wanted: NDArray[np.bool_], compliance: SurfaceCompliance) -> Reach:
    """One that has the `wanted` (c,) nodes only."""
    nodes = np.flatnonzero(wanted)
    return Reach(nodes, compliance.block(nodes))
