"""What the heights of a dent do to its light: shadows that its walls cast, and parallax.

They are taken from the present surface at each linearisation, and as constant in the derivative.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_optics.light.light_map import LightMap
from gelslim_optics.light.relief import Relief

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class NodeRelief:
    """Light at the surface nodes over that of the slopes alone.

    Attributes:
        relief: Of the light that lights the gel.
        lattice: The nodes.
    """

    relief: Relief
    lattice: NodeLattice

    @classmethod
    def of(cls, light: LightMap, lattice: NodeLattice) -> NodeRelief | None:
        """For a traced light; None for one that has a single direction for each source."""
        return None if light.fans is None else cls(Relief(light), lattice)

    def at_nodes(self, height_mm: Array) -> Array | None:
        """Factor (c, k) on the direct light of each source; None for an untouched gel.

        Args:
            height_mm: (c,) of the nodes over the untouched gel.
        """
        if not height_mm.any():
            return None
        number = self.lattice.number
        height = np.where(number >= 0, height_mm[number], 0.0)
        found = self.relief.on(height.T, self.lattice.origin_mm, self.lattice.step_mm)
        x, y = self.lattice.place.T
        return np.asarray(found[y, x])
