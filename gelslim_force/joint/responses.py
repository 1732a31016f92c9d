"""What markers and light show of a force on a node: columns that are computed once and kept."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ifem_export.compliance.columns import SurfaceCompliance

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
_BATCH = 64


class Responses:
    """Motion of the markers under 1 N along each axis on each node.

    Args:
        compliance: Of the pad's surface.
        nodes_to_markers: (n, c) interpolation.
    """

    def __init__(self, compliance: SurfaceCompliance, nodes_to_markers: Any) -> None:
        self.compliance = compliance
        self._to_markers = nodes_to_markers
        markers, nodes = nodes_to_markers.shape
        self._values = np.zeros((nodes, 3, markers, 3), dtype=np.float32)
        self._made = np.zeros(nodes, dtype=bool)

    def prepare(self) -> None:
        """Compute all columns now, so that no frame waits for them."""
        self._make(np.arange(len(self._made)))

    def of_markers(self, nodes: Nodes) -> Array:
        """(n, 3, 3p) motion of the markers under forces on nodes (p,)."""
        self._make(nodes)
        chosen = self._values[nodes].astype(float)
        return np.ascontiguousarray(chosen.reshape(3 * len(nodes), -1, 3).transpose(1, 2, 0))

    def of_heights(self, nodes: Nodes, near: Nodes) -> Array:
        """(m, 3p) heights of the nodes `near` (m,) under forces on nodes (p,)."""
        columns = self.compliance.columns(nodes)[:, :, near, 2]
        return np.ascontiguousarray(columns.reshape(3 * len(nodes), -1).T, dtype=float)

    def displacement(self, nodes: Nodes, force_n: Array) -> Array:
        """(c, 3) motion of all nodes under forces (p, 3) on nodes (p,)."""
        return self.compliance.displacement(nodes, force_n)

    def _make(self, nodes: Nodes) -> None:
        missing = np.asarray(nodes)[~self._made[nodes]]
        for first in range(0, len(missing), _BATCH):
            part = missing[first : first + _BATCH]
            columns = self.compliance.columns(part)
            flat = columns.transpose(2, 0, 1, 3).reshape(columns.shape[2], -1)
            moved = (self._to_markers @ flat).reshape(-1, len(part), 3, 3)
            self._values[part] = moved.transpose(1, 2, 0, 3)
            self._made[part] = True
