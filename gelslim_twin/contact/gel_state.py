"""The gel at one pose: where its surface is and which forces act on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Touch(IntEnum):
    """What a surface node does."""

    FREE = 0
    STICK = 1
    SLIP = 2


@dataclass(frozen=True, eq=False)
class GelState:
    """Fields over the c nodes of `PadMesh.surface`."""

    displacement_mm: Array
    """(c, 3)."""
    force_n: Array
    """(c, 3) on the gel."""
    touch: NDArray[np.int8]
    """(c,) values of `Touch`."""
    solver: Mapping[str, float] = field(default_factory=dict)
    """What the solver reports: residual, penetration_mm, complementarity, iterations."""

    @classmethod
    def at_rest(cls, nodes: int) -> GelState:
        """Nothing touches."""
        nothing = np.zeros((nodes, 3))
        return cls(nothing, nothing, np.zeros(nodes, dtype=np.int8))

    def blended(self, later: GelState, part: float) -> GelState:
        """State `part` (0 ... 1) of the way to a later one: both fields on straight lines."""
        if part == 0.0:
            return self
        u = (1 - part) * self.displacement_mm + part * later.displacement_mm
        f = (1 - part) * self.force_n + part * later.force_n
        touch = self.touch if part < 0.5 else later.touch
        return GelState(u, f, touch, self.solver if part < 0.5 else later.solver)
