"""Surface operators of the infinite pad, whole or truncated, put right at the rim of a real one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import IfemError
from ifem_export.operators.compliance_gram import ComplianceGram
from ifem_export.operators.layered_operator import LayeredOperator
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import inner_solver
from ifem_export.operators.surface_field import checked

Array = NDArray[np.float64]
RESULTANT_RTOL = 1e-10


@dataclass(frozen=True, eq=False)
class Convolved:
    """Surface stiffness of the infinite pad: wrong near free edges, more so as ν nears 0.5.

    `missing` (c, 3, 3) in N/mm, where given, is added node by node.
    """

    name: str
    system: PadSystem
    stiffness: LayeredOperator
    missing: Array | None = None

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Convolution with the surface stiffness."""
        u = checked(displacement_mm, self.system.columns)
        force = np.asarray(self.stiffness(u[None])[0])
        if self.missing is not None:
            force += np.matmul(self.missing, u[:, :, None])[:, :, 0]
        return force

    def displacement(self, force_n: ArrayLike) -> Array:
        """Convolution with the infinite pad's compliance, whichever the truncation."""
        f = checked(force_n, self.system.columns)
        return np.asarray(self.system.surface_compliance_guess(f[None])[0])

    @cached_property
    def gram(self) -> ComplianceGram:
        """For fits of forces on few nodes."""
        return ComplianceGram(self.system.surface_compliance_guess)

    @property
    def n_bytes(self) -> int:
        """Bytes of the blocks."""
        return int(
            self.stiffness.blocks.nbytes + (0 if self.missing is None else self.missing.nbytes)
        )


def truncated(stiffness: LayeredOperator, radius: int) -> LayeredOperator:
    """The convolution cut off at `radius` nodes, what is cut lumped onto the diagonal.

    Lumping keeps the force of a uniform motion. Raises IfemError for a radius below 1.
    """
    if radius < 1:
        raise IfemError(f"truncation radius = {radius}: must be at least 1 node")
    rows, columns = stiffness.shape
    kernel = np.fft.irfft2(stiffness.blocks, s=stiffness.shape, axes=(0, 1))
    away_y = np.minimum(np.arange(rows), rows - np.arange(rows))
    away_x = np.minimum(np.arange(columns), columns - np.arange(columns))
    near = np.hypot(away_y[:, None], away_x[None, :]) <= radius
    cut = np.where(near[..., None, None], kernel, 0.0)
    cut[0, 0] += (kernel - cut).sum(axis=(0, 1))
    blocks = np.fft.rfft2(cut, axes=(0, 1))
    return LayeredOperator(blocks, stiffness.columns, stiffness.shape)


def missing_resultant(system: PadSystem, stiffness: LayeredOperator) -> Array:
    """Node by node, what the convolution lacks of the resultant.

    The resultant of any motion u is Σ_j (Σ_i S_ij) u_j, and S is symmetric: three forces S e of
    uniform motions e give the sums. With what is missing put on the diagonal, the resultant of
    every motion is exact, wherever it is.

    Returns:
        (c, 3, 3) in N/mm, force by displacement component.
    """
    solver = inner_solver(system)
    lacking = np.empty((system.columns, 3, 3))
    for axis in range(3):
        shift = np.zeros((system.columns, 3))
        shift[:, axis] = 1.0
        u = shift.reshape(-1)
        held = solver.solve(-(system.surface_to_inner @ u), RESULTANT_RTOL).x
        exact = (system.surface @ u + system.inner_to_surface @ held).reshape(-1, 3)
        lacking[:, axis, :] = exact - stiffness(shift[None])[0]
    return lacking
