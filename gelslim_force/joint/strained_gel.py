"""What a gel at large strain moves further than a linear one under the same forces.

With the forces F(u) that hold the surface in a motion u, and the compliance C of the linear gel,
the motion under forces f is u = C f + e. The excess e is found by steps

    e <- e - C' (F(u) - f)

as the forces f are found, one for each linearisation. C' is the compliance of the infinite pad: it
decides how fast the steps converge, and not where.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.finite_strain import FiniteStrainForce, HeldPad
from ifem_export.bundle.bundle import Bundle
from ifem_export.operators.pad_system import PadSystem

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Excess:
    """What the gel moves further.

    Attributes:
        moved_mm: (c, 3) of the surface nodes.
        pad: The pad at large strain that it was found with; None for a linear gel.
    """

    moved_mm: Array
    pad: HeldPad | None = None


@dataclass(frozen=True, eq=False)
class StrainedGel:
    """The neo-Hookean law for deep contacts.

    Attributes:
        law: From motion (c, 3) to forces (c, 3).
        infinite_pad: Motion (1, c, 3) in mm of the infinite linear pad under forces (1, c, 3) in N.
        from_mm: Depth from which it is used.
    """

    law: FiniteStrainForce
    infinite_pad: Callable[[Array], Array]
    from_mm: float

    @classmethod
    def of(cls, bundle: Bundle, from_mm: float) -> StrainedGel:
        """The law of a bundle. Raises MeshError for a pad whose layers differ."""
        system = PadSystem(bundle.mesh, np.asarray(bundle.element_matrix), bundle.membranes)
        return cls(FiniteStrainForce.per_frame(bundle), system.mirrored_compliance, from_mm)

    def excess(self, moved_mm: Array, force_n: Array, known: Excess) -> Excess:
        """One step of the excess.

        Args:
            moved_mm: (c, 3) motion of the surface, with the excess that is known.
            force_n: (c, 3) forces on it.
            known: That excess.

        Raises:
            FiniteStrainError: The motion inverts a cell.
            ConvergenceError: The inner nodes do not come to balance.
        """
        pad = self.law.held(moved_mm, known.pad)
        missing_n = pad.force_n - force_n
        return Excess(known.moved_mm - self.infinite_pad(missing_n[None])[0], pad)
