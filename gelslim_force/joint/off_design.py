"""What a gel and a camera that are not as specified do to forces by the markers alone.

Forces f are the weighted mean F y of the motion y of the markers, which the model predicts as A f.
A parameter of the model that differs by dθ changes them by -F (dA/dθ) f dθ. For the gel, A is the
response of the markers to forces, and dA/dθ the difference of those of two pads. For the camera it
is the lateral motion that a picture shows per mm of height.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.marker_rows import MarkerRows
from ifem_export.compliance.columns import SurfaceCompliance

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
_BATCH = 64


@dataclass(frozen=True, eq=False)
class OffDesign:
    """Derivatives of what the n markers show of forces on c nodes, by p parameters of the gel.

    Attributes:
        by_gel: (p, c, 3, n, 2) lateral motion of the markers in mm as a picture shows it, per N
            along each axis on each node and per unit of the parameter.
        nodes_to_markers: (n, c) interpolation.
        lean_sigma: Standard deviation of the lateral motion that a picture shows per mm of height.
    """

    by_gel: NDArray[np.float32]
    nodes_to_markers: Any
    lean_sigma: float

    @classmethod
    def of(
        cls,
        compliance: SurfaceCompliance,
        more: Sequence[tuple[Bundle, float]],
        nodes_to_markers: Any,
        by_height: Array,
        lean_sigma: float,
    ) -> OffDesign:
        """Make it for one sensor; each parameter takes as long as all columns of its pad.

        Args:
            compliance: Of the sensor.
            more: The sensor with more of each parameter, and how much more.
            nodes_to_markers: (n, c) interpolation.
            by_height: (n, 2) lateral motion that the picture shows per mm less of its height.
            lean_sigma: Standard deviation of `by_height`, the same for all markers.
        """
        markers, nodes = nodes_to_markers.shape
        found = np.zeros((len(more), nodes, 3, markers, 2), dtype=np.float32)
        for derivative, (bundle, step) in zip(found, more, strict=True):
            varied = SurfaceCompliance(bundle, skin=bundle.membranes)
            for first in range(0, nodes, _BATCH):
                part = np.arange(first, min(first + _BATCH, nodes))
                change = (varied.columns(part) - compliance.columns(part)) / step
                flat = change.transpose(2, 0, 1, 3).reshape(nodes, -1)
                moved = (nodes_to_markers @ flat).reshape(markers, len(part), 3, 3)
                seen = moved[..., :2] - by_height[:, None, None] * moved[..., 2:]
                derivative[part] = seen.transpose(1, 2, 0, 3)
        return cls(found, nodes_to_markers, lean_sigma)

    def by_parameter(
        self, rows: MarkerRows, spread: Array, nodes: NDArray[np.intp], force_n: Array
    ) -> Array | None:
        """Change (p, 6) of six sums of the forces per unit of each parameter of the gel.

        Args:
            rows: Markers from which the forces follow.
            spread: (6, 3k) product of the sums with the covariance of the forces.
            nodes: (k,) nodes in contact.
            force_n: (k, 3) forces on them.

        Returns:
            The change; None without parameters.
        """
        if not len(self.by_gel):
            return None
        by_motion = rows.by_motion(spread)
        moved = np.einsum("pkanb,ka->pnb", self.by_gel[:, nodes], force_n.astype(np.float32))
        return np.asarray(-np.einsum("anb,pnb->pa", by_motion, moved[:, rows.used]))

    def by_camera(self, rows: MarkerRows, spread: Array, height_mm: Array) -> Array:
        """Covariance (6, 6) of six sums of the forces by the lean of the camera's view.

        Args:
            rows: As in `by_parameter`.
            spread: As in `by_parameter`.
            height_mm: (c,) of the surface nodes.
        """
        height = (self.nodes_to_markers @ height_mm)[rows.used]
        change = self.lean_sigma * np.einsum("anb,n->ab", rows.by_motion(spread), height)
        return np.asarray(change @ change.T)
