"""Change of the motion of a pad's surface by parameters of its gel, such as Poisson's ratio.

Under the same forces the surface of a pad with more of a parameter moves otherwise. The derivative
of the compliance by the parameter is the difference of those of two endless pads, which is a
convolution: it is made in milliseconds and takes no more memory than a few fields. The edge of the
pad is not taken into account.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ifem_export.operators.layer_elimination import layer_elimination
from ifem_export.operators.layered_operator import padding_columns
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.preconditioner import MirroredOperator

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ComplianceChange:
    """Derivatives of the surface compliance of an endless pad by p parameters.

    Attributes:
        blocks: (p, ky >= 0, kx, 3, 3) in mm/N per unit of each parameter, as of `MirroredOperator`.
        columns: (c, 2) lattice positions (j, i) of the nodes.
        shape: Size (rows, columns) of the padded lattice, both even.
    """

    blocks: Array
    columns: NDArray[np.int64]
    shape: tuple[int, int]

    @classmethod
    def of(cls, bundle: Bundle, more: Sequence[tuple[Bundle, float]]) -> ComplianceChange:
        """By differences of two pads.

        Args:
            bundle: The sensor, whose pad is flat.
            more: The sensor with more of each parameter, and how much more; one at least. The pads
                have the same lattice of nodes.

        Raises:
            MeshError: The pad is crowned.
            IfemError: The element is not its own mirror image.
        """
        mesh = bundle.mesh
        columns = PadSystem(mesh, np.asarray(bundle.element_matrix)).lattice_positions
        rows, across = (int(n) + 1 for n in columns.max(axis=0))
        padding = padding_columns(mesh.cell_size_mm, mesh.layers, (rows, across))
        pad = _surface_compliance(bundle, columns, padding)
        blocks = [
            (_surface_compliance(varied, columns, padding).blocks - pad.blocks) / step
            for varied, step in more
        ]
        return cls(np.stack(blocks), columns, pad.shape)

    def motion(self, force_n: Array) -> Array:
        """Change (p, c, 3) in mm of the motion per unit of each parameter, under forces (c, 3)."""
        from ifem_export.operators.mirrored_kernel import collect, multiply, spread

        lattice = np.empty((*self.shape, 1, 3))
        spread(np.ascontiguousarray(force_n[None]), self.columns, lattice)
        waves = np.repeat(fft.rfft2(lattice, axes=(0, 1), workers=1), len(self.blocks), axis=2)
        for number, blocks in enumerate(self.blocks):
            multiply(blocks, waves[:, :, number])
        moved = fft.irfft2(waves, s=self.shape, axes=(0, 1), workers=1, overwrite_x=True)
        found = np.empty((len(self.blocks), *force_n.shape))
        collect(moved, self.columns, found)
        return found


def _surface_compliance(
    bundle: Bundle, columns: NDArray[np.int64], padding: tuple[int, int]
) -> MirroredOperator:
    on_surface = None
    if bundle.membranes:
        from ifem_export.elements.membrane import membrane_symbol

        size, skin = bundle.mesh.cell_size_mm[:2], bundle.membranes

        def on_surface(shape: tuple[int, int]) -> Array:
            return membrane_symbol(size, skin, shape)

    element = np.asarray(bundle.element_matrix)
    layer = layer_elimination(element, bundle.mesh.layers, columns, padding, on_surface=on_surface)
    return layer.surface_compliance
