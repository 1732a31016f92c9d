"""Surface compliance of a pad with too many nodes for a table of columns.

Far from the rim the compliance is a convolution with that of the infinite pad. What the rim adds is
found by conjugate gradients on the whole pad, which the infinite pad preconditions: far from the
rim its first result is the solution. Memory grows with the number of nodes, and time with n log n.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ifem_export.bundle.bundle import Bundle
from ifem_export.compliance.node_convolution import LatticeKernel, NodeConvolution
from ifem_export.errors import MeshError
from ifem_export.operators.layer_elimination import LayerElimination
from ifem_export.operators.matrix_free import LatticeMatrix, LatticeProduct
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import ConjugateGradients
from ifem_export.operators.symmetric_matrix import Matrix, matrix_bytes

if TYPE_CHECKING:
    from ifem_export.elements.skin import Membrane

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]


class ConvolvedCompliance:
    """Compliance of a bundle's flat pad: of the infinite pad, and exact by a solve.

    Args:
        bundle: The sensor.
        skin: Membranes on the surface, whose stiffness adds to that of the pad.

    Attributes:
        bundle: As given.
        skin: As given.
        nodes: Surface nodes c.
        iterations: Conjugate-gradient iterations taken so far.

    Raises:
        MeshError: The pad is crowned or has cut cells.
    """

    def __init__(self, bundle: Bundle, skin: tuple[Membrane, ...] = ()) -> None:
        mesh = bundle.mesh
        if mesh.surface_shift is not None or mesh.fill is not None:
            raise MeshError(
                f"{len(mesh.surface)} surface nodes on a pad that is crowned or has cut cells: "
                "beyond what a table of columns holds only flat pads of whole cells are solved; "
                "mesh the pad with larger cells, or make it flat and set mesh.weighting to "
                "cell_centre",
                field="mesh",
                value=len(mesh.surface),
            )
        self.bundle = bundle
        self.skin = skin
        self.nodes = len(mesh.surface)
        self.iterations = 0

    @cached_property
    def system(self) -> PadSystem:
        """Equations of the pad."""
        return PadSystem(self.bundle.mesh, np.asarray(self.bundle.element_matrix))

    @cached_property
    def infinite(self) -> LayerElimination:
        """The infinite pad."""
        if not self.skin:
            return self.system.elimination
        from ifem_export.elements.membrane import membrane_symbol

        size = self.bundle.mesh.cell_size_mm[:2]
        return self.system.eliminated(lambda shape: membrane_symbol(size, self.skin, shape))

    @cached_property
    def _gradients(self) -> ConjugateGradients:
        system = self.system
        matrix: Matrix = LatticeMatrix(
            LatticeProduct(system), system.layers, lambda: system.stiffness
        )
        if self.skin:
            from ifem_export.elements.membrane import membrane_stiffness

            matrix = SkinnedMatrix(matrix, membrane_stiffness(self.bundle.mesh, self.skin))
        return ConjugateGradients(matrix, self.infinite, system.layers)

    @cached_property
    def _kernels(self) -> tuple[LatticeKernel, LatticeKernel]:
        compliance, shape = self.infinite.surface_compliance, self.infinite.shape
        return LatticeKernel(compliance.blocks, shape), LatticeKernel(
            self.infinite.stiffness, shape
        )

    def block(self, nodes: Nodes, known: NodeConvolution | None = None) -> NodeConvolution:
        """Compliance of the infinite pad among nodes (n,). `known` is not used."""
        positions = self.system.lattice_positions[nodes]
        compliance, stiffness = self._kernels
        return NodeConvolution(
            compliance.window(positions), stiffness.window(positions), compliance.own
        )

    def displacement(self, nodes: Nodes, force_n: Array, known_mm: Array | None = None) -> Array:
        """Displacement (c, 3) in mm of the infinite pad under forces (n, 3) on `nodes` (n,).

        `known_mm` (n, 3) is the displacement of `nodes`, where it is known.
        """
        force = np.zeros((1, self.nodes, 3))
        force[0, nodes] = force_n
        found = np.asarray(self.infinite.surface_compliance(force)[0])
        if known_mm is not None:
            found[nodes] = known_mm
        return found

    def whole(self, force_n: Array, rtol: float = 1e-8) -> Array:
        """Exact displacement (c, 3) in mm under forces (c, 3) in N on all nodes.

        `rtol` is the relative residual of the forces. Raises ConvergenceError where conjugate
        gradients do not reach it.
        """
        load = np.zeros((self.system.layers, self.nodes, 3))
        load[-1] = force_n
        solution = self._gradients.solve(load.ravel(), rtol)
        self.iterations += solution.iterations
        return np.array(solution.x.reshape(load.shape)[-1])

    @property
    def n_bytes(self) -> int:
        """Bytes that are kept: all blocks, and the kernels of the surface."""
        kernels = sum(k.blocks.nbytes + k.response.nbytes for k in self._kernels)
        return int(self.infinite.inverses.nbytes + self.infinite.coupling.nbytes + kernels)

    def store(self) -> None:
        """Nothing is worth storing: the blocks take less time to make than to read."""


@dataclass(frozen=True, eq=False)
class SkinnedMatrix:
    """The stiffness of a pad's free nodes with membranes on its surface, as a product.

    Attributes:
        pad: That of the pad; the surface comes last.
        skin: That of the membranes, among the surface nodes.
    """

    pad: Matrix
    skin: sparse.csr_array

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of rows and of columns."""
        return self.pad.shape

    def __matmul__(self, x: Array) -> Array:
        """Forces (n,) of displacements (n,)."""
        found = np.asarray(self.pad @ x)
        size = self.skin.shape[0]
        found[-size:] += self.skin @ x[-size:]
        return found

    @property
    def n_bytes(self) -> int:
        """Bytes that a product reads and writes."""
        return matrix_bytes(self.pad) + matrix_bytes(self.skin)

    def tocsr(self) -> sparse.csr_array:
        """The assembled matrix."""
        from ifem_export.elements.membrane import with_skin

        return with_skin(self.pad.tocsr(), self.skin)
