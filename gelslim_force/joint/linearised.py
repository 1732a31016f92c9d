"""The data of a frame near a contact, linear in the forces about an estimate."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.light_sums import LightSums
from gelslim_force.joint.marker_rows import MarkerRows
from gelslim_force.joint.normal_equations import NormalEquations

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Linearised:
    """Data by the forces on p nodes.

    Attributes:
        nodes: (p,) those whose forces are sought.
        start: (3p,) their forces to start from.
        moved_mm: (c, 3) motion of the surface in the estimate.
        offset_mm: (c, 3) by which it differs from that of a linear gel.
        gain: Of the light in the estimate.
        deepness: Of the contact in the estimate.
        equations: Of the data, without a prior.
        markers: Data of the markers.
        light: Data of the light; None without light.
        heights: (m, 3p) heights of the nodes of `light` per force; None without light.
        higher_mm: (m,) change of these heights from the estimate to the start.
    """

    nodes: Nodes
    start: Array
    moved_mm: Array
    offset_mm: Array
    gain: float
    deepness: float
    equations: NormalEquations
    markers: MarkerRows
    light: LightSums | None
    heights: Any
    higher_mm: Array | float = 0.0

    def heights_after(self, force: Array) -> Array | None:
        """Change (m,) of the heights from the estimate to forces (3p,); None without light."""
        if self.light is None:
            return None
        step = (force - self.start).astype(self.heights.dtype)
        return np.asarray(self.higher_mm + self.heights @ step, dtype=float)

    def on(self, nodes: Nodes) -> Linearised:
        """The same data where only some of the nodes (q,) may press; the others bear no force."""
        kept = np.isin(self.nodes, nodes, assume_unique=True)
        free, lost = (np.flatnonzero(np.repeat(part, 3)) for part in (kept, ~kept))
        less = -self.start[lost]
        own = self.equations.hessian[free]
        slope = self.equations.slope[free] + own[:, lost] @ less
        rows = self.markers.rows
        markers = replace(
            self.markers,
            rows=np.ascontiguousarray(rows[:, free]),
            residual=self.markers.residual - rows[:, lost] @ less.astype(rows.dtype),
        )
        heights, higher = self.heights, self.higher_mm
        if heights is not None:
            higher = higher + heights[:, lost] @ less.astype(heights.dtype)
            heights = np.ascontiguousarray(heights[:, free])
        return replace(
            self,
            nodes=nodes,
            start=self.start[free],
            equations=NormalEquations(np.ascontiguousarray(own[:, free]), slope),
            markers=markers,
            heights=heights,
            higher_mm=higher,
        )
