"""Surface operators of the infinite pad, complete or truncated, corrected at the rim of the pad.

Fits of forces f on few nodes to a motion u of the whole surface, |C f - u|², need the compliance C
only through the products CᵀC among those nodes. For a convolution these form a convolution again
as long as the pad is not cropped. Cropping can only reduce them. The products kept here are
therefore an upper bound: the steps of a fit that uses them never overshoot, and the products are
exact far from the rim.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import IfemError
from ifem_export.operators.adjoint_fields import AdjointFields, rigid_motions
from ifem_export.operators.layered_operator import LayeredOperator
from ifem_export.operators.pad_system import PadSystem, checked_field

Array = NDArray[np.float64]


class ComplianceProducts:
    """Upper bound of CᵀC for a cropped convolution C with blocks (ky, kx, 3, 3)."""

    def __init__(self, compliance: LayeredOperator) -> None:
        self._compliance = compliance

    @cached_property
    def kernel(self) -> Array:
        """(rows, columns, 3, 3) in mm²/N² for two nodes by their lattice distance, periodic."""
        blocks, shape = self._compliance.blocks, self._compliance.shape
        square = np.matmul(blocks.conj().swapaxes(-1, -2), blocks)
        return np.ascontiguousarray(np.fft.irfft2(square, s=shape, axes=(0, 1)))

    def block(self, nodes: NDArray[np.intp]) -> Array:
        """Symmetric matrix (3n, 3n) of the products among the surface nodes (n,)."""
        from ifem_export.operators.surface_kernel import gather_products

        out = np.empty((3 * len(nodes), 3 * len(nodes)))
        gather_products(self.kernel, np.ascontiguousarray(self._compliance.columns[nodes]), out)
        return out


@dataclass(frozen=True, eq=False)
class ConvolvedOperator:
    """Convolution with the surface stiffness of the infinite pad.

    Near free edges it has an error, which grows as ν approaches 0.5.

    Attributes:
        name: Name of the rung.
        system: Equations of the pad.
        stiffness: Surface stiffness of the infinite pad, complete or truncated.
        missing: (c, 3, 3) in N/mm, added node by node so that the resultant is exact; or None.
        adjoint: Adjoint fields that make force and torque exact; or None.
    """

    name: str
    system: PadSystem
    stiffness: LayeredOperator
    missing: Array | None = None
    adjoint: AdjointFields | None = None

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Convolution with the surface stiffness."""
        u = checked_field(displacement_mm, self.system.columns)
        force = np.asarray(self.stiffness(u[None])[0])
        if self.missing is not None:
            force += np.matmul(self.missing, u[:, :, None])[:, :, 0]
        return force if self.adjoint is None else self.adjoint.completed(force, u)

    def displacement(self, force_n: ArrayLike) -> Array:
        """Convolution with the compliance of the infinite pad, which is not truncated."""
        f = checked_field(force_n, self.system.columns)
        return np.asarray(self.system.infinite_compliance(f[None])[0])

    @cached_property
    def compliance_products(self) -> ComplianceProducts:
        """Products CᵀC for fits of forces on few nodes."""
        return ComplianceProducts(self.system.infinite_compliance)

    @property
    def n_bytes(self) -> int:
        """Bytes of the blocks."""
        missing = 0 if self.missing is None else self.missing.nbytes
        adjoint = 0 if self.adjoint is None else self.adjoint.n_bytes
        return int(self.stiffness.blocks.nbytes + missing + adjoint)


def truncated(stiffness: LayeredOperator, radius: int) -> LayeredOperator:
    """The convolution truncated at `radius` nodes, with the remainder lumped onto the diagonal.

    Lumping keeps the force of a uniform motion. Raises IfemError for a radius below 1.
    """
    if radius < 1:
        raise IfemError(
            f"truncation radius = {radius}: must be at least 1 node", field="radius", value=radius
        )
    rows, columns = stiffness.shape
    kernel = np.fft.irfft2(stiffness.blocks, s=stiffness.shape, axes=(0, 1))
    away_y = np.minimum(np.arange(rows), rows - np.arange(rows))
    away_x = np.minimum(np.arange(columns), columns - np.arange(columns))
    near = np.hypot(away_y[:, None], away_x[None, :]) <= radius
    cut = np.where(near[..., None, None], kernel, 0.0)
    cut[0, 0] += (kernel - cut).sum(axis=(0, 1))
    blocks = np.fft.rfft2(cut, axes=(0, 1))
    return LayeredOperator(blocks, stiffness.columns, stiffness.shape)


def missing_resultant(adjoint: AdjointFields, stiffness: LayeredOperator) -> Array:
    """What the convolution lacks of the exact resultant, node by node.

    The resultant of a motion u is Σ_j (Σ_i S_ij) u_j, and S is symmetric. Therefore the three
    forces S e of uniform unit motions e give the sums over i. With the missing part added to the
    diagonal, the resultant of every motion is exact, also at the rim.

    Returns:
        (c, 3, 3) in N/mm, force component by displacement component.
    """
    uniform = zip(rigid_motions(adjoint.points_mm)[:3], adjoint.forces[:3], strict=True)
    return np.stack([force - stiffness(motion[None])[0] for motion, force in uniform], axis=1)
