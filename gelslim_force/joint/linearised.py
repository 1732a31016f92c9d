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
        heights: (m, 3r) heights of the nodes of `light` per force on the r nodes of the estimate;
            None without light.
        step: (3r,) change of the forces from the estimate to the start; None for no change.
        free: (3p,) numbers of the forces sought among those; None for all.
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
    step: Array | None = None
    free: Nodes | None = None

    def heights_after(self, force: Array) -> Array | None:
        """Change (m,) of the heights from the estimate to forces (3p,); None without light."""
        if self.light is None:
            return None
        step = force - self.start
        if self.step is not None:
            whole = self.step.copy()
            whole[self.free] = step
            step = whole
        return np.asarray(self.heights @ step.astype(self.heights.dtype), dtype=float)

    def on(self, nodes: Nodes) -> Linearised:
        """The same data where only some of the nodes (q,) may press; the others bear no force.

        The data must be those of all nodes.
        """
        from gelslim_force.joint.equations_kernel import take_nodes

        kept = np.flatnonzero(np.isin(self.nodes, nodes, assume_unique=True))
        free = (3 * kept[:, None] + np.arange(3)).ravel()
        step = -self.start
        step[free] = 0.0
        hessian, own = self.equations.hessian, np.empty((len(free), len(free)))
        take_nodes(hessian[free], kept, own)
        rows = np.empty((len(self.markers.rows), len(free)), dtype=self.markers.rows.dtype)
        take_nodes(self.markers.rows, kept, rows)
        return replace(
            self,
            nodes=nodes,
            start=self.start[free],
            equations=NormalEquations(own, (self.equations.slope + hessian @ step)[free]),
            markers=replace(self.markers.after(step), rows=rows),
            step=step,
            free=free,
        )
