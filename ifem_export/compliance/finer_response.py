"""What a finer pad does between the nodes of a pad: heights that its own nodes do not show.

A mesh does not resolve how the surface bends where a pressure ends: neither are the heights of its
nodes right there, nor does interpolation show what lies between them. The same layer with four
times as many cells along each axis shows both. Its heights at half steps x are those of the nodes,
interpolated by cubic convolution I, and a sum over the nodes j with forces f_j:

    w(x) = (I w)(x) + sum of s(x - x_j) f_j.

The stencil s is the height of the finer layer under the force of one node less the interpolated
height of the layer. Both are endless, so that s depends on the distance only. It decays within a
few nodes, because forces that are only spread differently move nothing far away (Saint-Venant).

Nodal forces are those of a traction t by the nodes' bilinear functions N, f_j = ∫ N_j t. The finer
layer is loaded by the one traction that is bilinear between the nodes and has these forces,
t = Σ c_j N_j with M c = f and the mass matrix M_ij = ∫ N_i N_j.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ifem_export.compliance.node_convolution import LatticeKernel
from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.operators.layer_elimination import layer_elimination
from ifem_export.operators.layered_operator import even_fast_length

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
FINER = 4
"""Cells of the finer pad along each axis for one of the pad; even."""
REACH = 8
"""Half steps up to which the stencil is taken."""
_THICKNESSES, _LEAST = 8, 24
"""Period of the endless layers: in thicknesses, and at least in nodes."""


def finer_response(bundle: Bundle) -> Array:
    """Stencil (2r + 1, 2r + 1, 3) in mm/N, with r = `REACH`.

    Entry (r + a, r + b, k) is what the finer layer adds to the interpolated height at the distance
    (a hx / 2, b hy / 2) from a node on which a force acts along axis k; hx and hy are the cells.

    Args:
        bundle: The pad. Its edges, a crown and cut cells are not taken into account.

    Raises:
        IfemError: The element is not its own mirror image.
    """
    mesh = bundle.mesh
    hx, hy, hz = mesh.cell_size_mm
    thickness = hz * mesh.layers
    rows, columns = (
        even_fast_length(max(_LEAST, int(np.ceil(_THICKNESSES * thickness / h)))) for h in (hy, hx)
    )
    heights = layer_heights(np.asarray(bundle.element_matrix), mesh.layers, (rows, columns))
    cell = hx / FINER, hy / FINER, hz / FINER
    element = hex8_stiffness(cell, bundle.material, bundle.formulation)
    fine = layer_heights(element, FINER * mesh.layers, (FINER * rows, FINER * columns))
    load = np.outer(spread_force(rows), spread_force(columns))
    waves = fft.rfft2(fine, axes=(0, 1)) * fft.rfft2(load)[..., None]
    half = FINER // 2
    loaded = fft.irfft2(waves, s=load.shape, axes=(0, 1))[::half, ::half]
    along_y, along_x = _interpolation(rows), _interpolation(columns)
    smooth = np.einsum("ai,ijk,bj->abk", along_y, heights, along_x, optimize=True)
    near = np.arange(-REACH, REACH + 1)
    return np.ascontiguousarray((loaded - smooth)[np.ix_(near, near)].transpose(1, 0, 2))


def layer_heights(element_matrix: Array, layers: int, shape: tuple[int, int]) -> Array:
    """(rows, columns, 3) heights in mm of an endless layer under 1 N on the first node.

    Args:
        element_matrix: (24, 24) in N/mm.
        layers: Of cells.
        shape: Rows and columns of nodes after which the layer repeats, both even.
    """
    last = np.array([shape], dtype=np.int64) - 1
    layer = layer_elimination(element_matrix, layers, last, (0, 0))
    return LatticeKernel(layer.surface_compliance.blocks, layer.shape).response[:, :, 2]


def spread_force(count: int) -> Array:
    """Forces (FINER * count,) on the fine nodes of a closed line for the force 1 on node 0.

    They are those of a traction that is linear between the `count` nodes. Lumped to these by
    linear functions they are 1 on node 0 and 0 on the others.
    """
    steps = np.arange(FINER * count)
    hat = np.maximum(1 - np.minimum(steps, FINER * count - steps) / FINER, 0.0)
    hats = np.stack([np.roll(hat, FINER * node) for node in range(count)])
    return np.asarray(np.linalg.solve(hats @ hats.T, np.eye(count)[0]) @ hats)


def _interpolation(count: int) -> Array:
    """(2 count, count) cubic convolution on a closed line, at its nodes and half way between."""
    found = np.zeros((2 * count, count))
    for node in range(count):
        found[2 * node, node] = 1.0
        for step, weight in ((-1, -1), (0, 9), (1, 9), (2, -1)):
            found[2 * node + 1, (node + step) % count] += weight / 16
    return found
