"""What markers and light show of a force on a node: columns that are computed once and kept."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.layer.beyond_mesh import NearMotion
from ifem_export.compliance.columns import SurfaceCompliance

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]
Nodes = NDArray[np.intp]
_BATCH = 64


class Responses:
    """Motion of the markers and heights of the nodes under 1 N along each axis on each node.

    Args:
        compliance: Of the pad's surface.
        nodes_to_markers: (n, c) interpolation.
        by_height: (n, 2) lateral motion that a picture shows per mm less of a marker's height.
        beyond: What the mesh leaves out near a force, and the places (n, 2) of the markers at rest;
            None to leave it out.
    """

    def __init__(
        self,
        compliance: SurfaceCompliance,
        nodes_to_markers: Any,
        by_height: Array,
        beyond: tuple[NearMotion, Array] | None = None,
    ) -> None:
        self.compliance = compliance
        self._to_markers = nodes_to_markers
        self._by_height = by_height.astype(np.float32)
        self._beyond = beyond
        markers, nodes = nodes_to_markers.shape
        self._markers = np.zeros((markers, 2, nodes, 3), dtype=np.float32)
        self._beyond_mesh = np.zeros_like(self._markers) if beyond else None
        self._heights = np.zeros((nodes, nodes, 3), dtype=np.float32)
        self._made = np.zeros(nodes, dtype=bool)

    @property
    def markers(self) -> int:
        """Number of markers n."""
        return len(self._markers)

    def prepare(self) -> None:
        """Compute all columns now, so that no frame waits for them."""
        self._make(np.arange(len(self._made)))

    def of_markers(self, nodes: Nodes, markers: Nodes) -> Single:
        """(2m, 3p) motion of markers (m,) as a picture shows it, under forces on nodes (p,)."""
        from gelslim_force.joint.kernels.light_kernel import gather_markers

        self._make(nodes)
        rows = np.empty((2 * len(markers), 3 * len(nodes)), dtype=np.float32)
        gather_markers(self._markers, markers, nodes, rows)
        return rows

    def beyond_mesh(self, nodes: Nodes, force_n: Array, markers: Nodes) -> Array:
        """(m, 2) what markers (m,) move more than the nodes about them, as a picture shows it.

        It is under forces (p, 3) on nodes (p,), whose columns are known.
        """
        from gelslim_force.joint.kernels.light_kernel import add_markers

        found = np.zeros((len(markers), 2))
        if self._beyond_mesh is not None:
            force = np.ascontiguousarray(force_n, dtype=float)
            add_markers(self._beyond_mesh, markers, np.asarray(nodes), force, found)
        return found

    def of_heights(self, nodes: Nodes, near: Nodes) -> Single:
        """(m, 3p) heights of the nodes `near` (m,) under forces on nodes (p,)."""
        from gelslim_force.joint.kernels.light_kernel import gather_heights

        self._make(nodes)
        heights = np.empty((len(near), 3 * len(nodes)), dtype=np.float32)
        gather_heights(self._heights, near, nodes, heights)
        return heights

    def displacement(self, nodes: Nodes, force_n: Array) -> Array:
        """(c, 3) motion of all nodes under forces (p, 3) on nodes (p,)."""
        return self.compliance.displacement(nodes, force_n)

    def _make(self, nodes: Nodes) -> None:
        missing = np.asarray(nodes)[~self._made[nodes]]
        for first in range(0, len(missing), _BATCH):
            part = missing[first : first + _BATCH]
            columns = self.compliance.columns(part)
            flat = columns.transpose(2, 0, 1, 3).reshape(columns.shape[2], -1)
            moved = (self._to_markers @ flat).reshape(-1, len(part), 3, 3).transpose(0, 3, 1, 2)
            lean = self._by_height[:, :, None, None]
            self._markers[:, :, part] = moved[:, :2] - lean * moved[:, 2:].astype(np.float32)
            self._heights[:, part] = columns[..., 2].transpose(2, 0, 1)
            self._add_beyond(part)
            self._made[part] = True

    def _add_beyond(self, nodes: Nodes) -> None:
        if self._beyond is None or self._beyond_mesh is None:
            return
        near, markers_mm = self._beyond
        points = np.asarray(self.compliance.bundle.mesh.surface_mm)[nodes, :2]
        away = markers_mm[:, None] - points
        marker, node = np.nonzero((np.abs(away) < near.reach_mm).all(axis=2))
        moved = near.at(away[marker, node])
        seen = moved[:, :2] - self._by_height[marker, :, None] * moved[:, 2:]
        self._beyond_mesh[marker, :, nodes[node]] = seen
        self._markers[marker, :, nodes[node]] += seen.astype(np.float32)
