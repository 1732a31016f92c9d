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

A pressure that ends between two nodes is one of forces at half steps. Such a force moves the
nodes as the forces do into which it splits, bilinearly, on the one, two or four nodes around it:
resultant and moments are the same. What it moves beside that decays as quickly, and is a stencil
again, one for each of the four places in a cell (`half_step_response`).
"""

from __future__ import annotations

from dataclasses import dataclass
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


@dataclass(frozen=True, eq=False)
class EndlessLayers:
    """Heights of a pad and of the finer one, both endless.

    Attributes:
        pad: (rows, columns, 3) in mm under 1 N on the first node.
        finer: The same of the finer layer, with `FINER` as many rows and columns.
    """

    pad: Array
    finer: Array

    @classmethod
    def of(cls, bundle: Bundle) -> EndlessLayers:
        """The layers of a pad; raises IfemError if the element is not its own mirror image."""
        mesh = bundle.mesh
        hx, hy, hz = mesh.cell_size_mm
        thickness = hz * mesh.layers
        rows, columns = (
            even_fast_length(max(_LEAST, int(np.ceil(_THICKNESSES * thickness / h))))
            for h in (hy, hx)
        )
        pad = layer_heights(np.asarray(bundle.element_matrix), mesh.layers, (rows, columns))
        cell = hx / FINER, hy / FINER, hz / FINER
        element = hex8_stiffness(cell, bundle.material, bundle.formulation)
        shape = FINER * rows, FINER * columns
        return cls(pad, layer_heights(element, FINER * mesh.layers, shape))

    def half_steps(self, cells: int) -> Array:
        """(2 rows, 2 columns, 3) heights at half steps under the force 1 on one place.

        Args:
            cells: Of the finer layer between two places: `FINER` for nodes, half of it for places
                at half steps.
        """
        along_y, along_x = (spread_force(n // cells, cells) for n in self.finer.shape[:2])
        load = np.outer(along_y, along_x)
        waves = fft.rfft2(self.finer, axes=(0, 1)) * fft.rfft2(load)[..., None]
        return fft.irfft2(waves, s=load.shape, axes=(0, 1))[:: FINER // 2, :: FINER // 2]

    def interpolated(self, heights: Array) -> Array:
        """(2 rows, 2 columns, k) at half steps by heights (rows, columns, k) of the nodes."""
        along_y, along_x = (_interpolation(n) for n in self.pad.shape[:2])
        return np.einsum("ai,ijk,bj->abk", along_y, heights, along_x, optimize=True)


def finer_response(bundle: Bundle, layers: EndlessLayers | None = None) -> Array:
    """Stencil (2r + 1, 2r + 1, 3) in mm/N, with r = `REACH`.

    Entry (r + a, r + b, k) is what the finer layer adds to the interpolated height at the distance
    (a hx / 2, b hy / 2) from a node on which a force acts along axis k; hx and hy are the cells.

    Args:
        bundle: The pad. Its edges, a crown and cut cells are not taken into account.
        layers: Those of the pad, where they are known already.

    Raises:
        IfemError: The element is not its own mirror image.
    """
    layers = layers or EndlessLayers.of(bundle)
    return _near(layers.half_steps(FINER) - layers.interpolated(layers.pad))


def half_step_response(bundle: Bundle, layers: EndlessLayers | None = None) -> Array:
    """Stencils (2, 2, 2r + 1, 2r + 1) in mm/N of normal forces at half steps, with r = `REACH`.

    Entry (u, v, r + a, r + b) is what the finer layer adds, at the distance (a hx / 2, b hy / 2)
    from the force, to the interpolated height under the forces on nodes into which it splits. The
    force is u half steps along x and v along y from a node. Arguments and errors are those of
    `finer_response`.
    """
    layers = layers or EndlessLayers.of(bundle)
    normal, loaded = layers.pad[..., 2:], layers.half_steps(FINER // 2)[..., 2:]
    found = np.empty((2, 2, 2 * REACH + 1, 2 * REACH + 1))
    for u, v in np.ndindex(2, 2):
        nodes = [(b, a) for a in range(u + 1) for b in range(v + 1)]
        split = np.mean([np.roll(normal, node, axis=(0, 1)) for node in nodes], axis=0)
        smooth = np.roll(layers.interpolated(split), (-v, -u), axis=(0, 1))
        found[u, v] = _near(loaded - smooth)[..., 0]
    return found


def _near(heights: Array) -> Array:
    """(2r + 1, 2r + 1, k) by steps along x and y, of (2 rows, 2 columns, k) about the first."""
    near = np.arange(-REACH, REACH + 1)
    return np.ascontiguousarray(heights[np.ix_(near, near)].transpose(1, 0, 2))


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


def spread_force(count: int, cells: int = FINER) -> Array:
    """Forces (cells * count,) on the fine nodes of a closed line for the force 1 on place 0.

    They are those of a traction that is linear between the `count` places, which are `cells` fine
    cells apart. Lumped to these by linear functions they are 1 on place 0 and 0 on the others.
    """
    steps = np.arange(cells * count)
    hat = np.maximum(1 - np.minimum(steps, cells * count - steps) / cells, 0.0)
    hats = np.stack([np.roll(hat, cells * place) for place in range(count)])
    return np.asarray(np.linalg.solve(hats @ hats.T, np.eye(count)[0]) @ hats)


def _interpolation(count: int) -> Array:
    """(2 count, count) cubic convolution on a closed line, at its nodes and half way between."""
    found = np.zeros((2 * count, count))
    for node in range(count):
        found[2 * node, node] = 1.0
        for step, weight in ((-1, -1), (0, 9), (1, 9), (2, -1)):
            found[2 * node + 1, (node + step) % count] += weight / 16
    return found
