"""The infinite pad's equations, solved layer by layer for every lateral wave vector.

All inner layers have the same blocks: A on the diagonal, B between a layer and the one above it,
and A' on the diagonal of the outer surface. Elimination from the bonded face upwards gives

    D_1 = A,  D_l = A - Bᵀ D_(l-1)⁻¹ B,  D_L = A' - Bᵀ D_(L-1)⁻¹ B,

and the last of them is the surface stiffness. The L blocks of 3 x 3 per wave vector take L times
less memory than the inverse of the whole block (3L x 3L), and as much less time to make and apply.
The blocks are those of `preconditioner`: real, for ky >= 0 and kx >= 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ifem_export.operators.preconditioner import MirroredOperator, mirrored_operator

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LayerElimination:
    """Inverse of the infinite pad's stiffness, restricted to the columns of a pad.

    It is a `Preconditioner` of the free nodes.

    Attributes:
        stiffness: (ky >= 0, kx, 3, 3) the last D in N/mm: the surface stiffness, unless the
            surface is held.
        inverses: (ky >= 0, kx, L, 3, 3) the inverses of D_1 to D_L in mm/N.
        coupling: (ky >= 0, kx, 3, 3) B in N/mm.
        columns: (c, 2) lattice positions (j, i) of the columns.
        shape: Size (rows, columns) of the padded lattice, both even.
    """

    stiffness: Array
    inverses: Array
    coupling: Array
    columns: NDArray[np.int64]
    shape: tuple[int, int]

    @property
    def blocks(self) -> Array:
        """What an application reads."""
        return self.inverses

    def __call__(self, field: Array) -> Array:
        """Apply to forces (L, c, 3) in N; the result (L, c, 3) is in mm."""
        from ifem_export.operators.layer_kernel import solve_layers
        from ifem_export.operators.mirrored_kernel import collect, spread

        lattice = np.empty((*self.shape, field.shape[0], 3))
        spread(np.ascontiguousarray(field), self.columns, lattice)
        waves = fft.rfft2(lattice, axes=(0, 1), workers=1)
        del lattice
        solve_layers(self.inverses, self.coupling, waves.reshape(*waves.shape[:2], -1))
        result = fft.irfft2(waves, s=self.shape, axes=(0, 1), workers=1, overwrite_x=True)
        found = np.empty(field.shape)
        collect(result, self.columns, found)
        return found

    @property
    def surface_compliance(self) -> MirroredOperator:
        """Displacement (1, c, 3) in mm of the infinite pad's surface under forces on it."""
        blocks = np.ascontiguousarray(self.inverses[..., -1, :, :])
        return MirroredOperator(blocks, self.columns, self.shape)


def layer_elimination(
    element_matrix: Array,
    layers: int,
    columns: NDArray[np.int64],
    padding: tuple[int, int],
    surface_held: bool = False,
    on_surface: Callable[[tuple[int, int]], Array] | None = None,
) -> LayerElimination:
    """The elimination of a pad's free layers.

    Args:
        element_matrix: (24, 24) in N/mm, of a brick of isotropic material.
        layers: Layers of free nodes, the outer surface last.
        columns: (c, 2) lattice positions (j, i), from 0.
        padding: Columns of zeros beyond the lattice along (y, x).
        surface_held: Whether the outer surface does not move, so that the layers below it are the
            free ones.
        on_surface: Function from the shape of the lattice to stiffness blocks (ky >= 0, kx, 3, 3)
            in N/mm that are added to those of the surface.

    Returns:
        The operator.

    Raises:
        IfemError: The element is not its own mirror image.
    """
    # An inner layer and the surface have all different blocks.
    pair = mirrored_operator(element_matrix, min(layers, 2), columns, padding, lambda k: k)
    inner, top = pair.blocks[..., :3, :3], pair.blocks[..., -3:, -3:]
    if on_surface is not None:
        top = top + on_surface(pair.shape)
    up = np.ascontiguousarray(pair.blocks[..., :3, -3:]) if layers > 1 else np.zeros_like(top)
    count = layers - 1 if surface_held else layers
    inverses = np.empty((*top.shape[:2], count, 3, 3))
    stiffness = top
    for layer in range(count):
        stiffness = np.array(top if layer == layers - 1 else inner)
        if layer > 0:
            stiffness -= up.swapaxes(-1, -2) @ inverses[..., layer - 1, :, :] @ up
        stiffness = (stiffness + stiffness.swapaxes(-1, -2)) / 2
        inverse = np.linalg.inv(stiffness)
        inverses[..., layer, :, :] = (inverse + inverse.swapaxes(-1, -2)) / 2
    return LayerElimination(stiffness, inverses, up, columns, pair.shape)
