"""Fields on the outer surface, (c, 3) over the nodes of `PadMesh.surface`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import IfemError
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import Solver, pad_solver

Array = NDArray[np.float64]
COMPLIANCE_RTOL = 1e-8


@dataclass(frozen=True, eq=False)
class SolvedCompliance:
    """Displacement under surface forces, by solving the whole pad."""

    system: PadSystem

    @cached_property
    def whole(self) -> Solver:
        """Solver of all free nodes."""
        return pad_solver(self.system)

    def displacement(self, force_n: ArrayLike) -> Array:
        """Surface part of K_ff u = f for forces (c, 3) on the surface alone."""
        f = checked(force_n, self.system.columns)
        whole = np.zeros((self.system.stiffness.shape[0] // 3, 3))
        whole[-self.system.columns :] = f
        moved = self.whole.solve(whole, COMPLIANCE_RTOL).x.reshape(-1, 3)
        return np.asarray(moved[-self.system.columns :])


def checked(field: ArrayLike, columns: int) -> Array:
    """A finite (c, 3) field."""
    values = np.asarray(field, dtype=float)
    if values.shape != (columns, 3):
        raise IfemError(f"the field has shape {values.shape}: must be ({columns}, 3)")
    if not np.isfinite(values).all():
        raise IfemError("the field holds a value that is not finite: fill lost markers first")
    return values
