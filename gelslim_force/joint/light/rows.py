"""The light near a contact as data of its forces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.light.sums import LightSums

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class LightRows:
    """Sums over the light by m heights, and these by r forces.

    Attributes:
        sums: Of the light.
        heights: (m, r) in mm/N.
        gain_sigma: Standard deviation of the gain of the light.
        free: (q,) numbers of the forces sought among those; None for all.
        interpolation: (f, c) heights of the places whose numbers `sums` has, by those of the
            nodes; None where the places are the nodes.
    """

    sums: LightSums
    heights: Any
    gain_sigma: float
    free: Nodes | None = None
    interpolation: Any = None

    def pull(self, height_mm: Array) -> Array:
        """What p changes of all heights (p, c) that the forces do not make add to the slope (p, q).

        It is Aᵀ W h for a model that has the data A x + h of forces x, with the gain eliminated as
        in `NormalEquations.with_light`: where the forces vary freely, they change by -H⁻¹ Aᵀ W h.
        """
        sums, heights = self.sums, height_mm.T
        if self.interpolation is not None:
            heights = self.interpolation @ heights
        near = heights[sums.nodes].T
        own = sums.by_gain + self.gain_sigma**-2
        weighted = near @ sums.matrix - np.outer(near @ sums.mixed / own, sums.mixed)
        found = np.asarray(weighted.astype(self.heights.dtype) @ self.heights, dtype=float)
        return found if self.free is None else found[:, self.free]
