"""What a mesh leaves out of the motion near a force, found with an endless layer.

A mesh does not resolve how the surface bends where a pressure ends. Neither are the nodes right
there, nor does interpolation show what lies between them. The layer without a mesh shows both, by
its waves. Its motion at a distance x from a node is that of the mesh, interpolated by I, and a sum
over the nodes j with forces f_j:

    u(x) = (I u)(x) + sum of s(x - x_j) f_j.

The stencil s is the motion of the layer under the force of one node less the interpolated motion of
the mesh. Both are endless, so that s depends on the distance only. It decays within a few nodes,
because forces that are only spread differently move nothing far away (Saint-Venant).

A pressure that ends between two nodes is one of forces at half steps. Such a force moves the
nodes as the forces do into which it splits, bilinearly, on the one, two or four nodes around it:
resultant and moments are the same. What it moves beside that decays as quickly, and is a stencil
again, one for each of the four places in a cell (`half_step_response`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.layer.layer_motion import Places, surface_motion
from gelslim_force.layer.layer_response import LayerResponse
from ifem_export.compliance.node_convolution import LatticeKernel
from ifem_export.operators.layer_elimination import layer_elimination
from ifem_export.operators.layered_operator import even_fast_length

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
REACH = 8
"""Half steps up to which the stencils of heights are taken."""
_BETWEEN, _CELLS = 8, 6
"""Steps per cell of a `NearMotion`, and cells up to which it is taken."""
_THICKNESSES, _LEAST = 8, 24
"""Period of the endless layers: in thicknesses, and at least in nodes."""


@dataclass(frozen=True, eq=False)
class EndlessLayers:
    """A pad without edges, by its mesh and without one.

    Attributes:
        mesh: Motion (rows, columns, 3, 3) in mm under 1 N along each axis on the first node.
        layer: The same layer without a mesh.
        youngs_modulus_mpa: Of both.
        cell_mm: Cells along x and y.
    """

    mesh: Array
    layer: LayerResponse
    youngs_modulus_mpa: float
    cell_mm: tuple[float, float]

    @classmethod
    def of(cls, bundle: Bundle) -> EndlessLayers:
        """The layers of a pad; raises IfemError if the element is not its own mirror image."""
        mesh, gel = bundle.mesh, bundle.material
        hx, hy, hz = mesh.cell_size_mm
        thickness = hz * mesh.layers
        shape = tuple(
            even_fast_length(max(_LEAST, int(np.ceil(_THICKNESSES * thickness / h))))
            for h in (hy, hx)
        )
        last = np.array([shape], dtype=np.int64) - 1
        element = np.asarray(bundle.element_matrix)
        cells = layer_elimination(element, mesh.layers, last, (0, 0))
        kernel = LatticeKernel(cells.surface_compliance.blocks, cells.shape)
        layer = LayerResponse(thickness, gel.poissons_ratio)
        return cls(kernel.response, layer, gel.youngs_modulus_mpa, (hx, hy))

    def exact(self, steps: int, nodes_per_cell: int = 1, disc_mm: float = 0.0) -> Array:
        """Motion (steps rows, steps columns, 3, 3) without a mesh at places between the nodes.

        Args:
            steps: From one node to the next.
            nodes_per_cell: Places that bear forces along a cell, of which the first has 1 N.
            disc_mm: As for `surface_motion`.
        """
        rows, columns = (steps * n for n in self.mesh.shape[:2])
        x, y = self.cell_mm
        places = Places(rows, columns, (x / steps, y / steps))
        pitch = x / nodes_per_cell, y / nodes_per_cell
        return surface_motion(self.layer, self.youngs_modulus_mpa, places, pitch, disc_mm)

    def interpolated(self, heights: Array) -> Array:
        """(2 rows, 2 columns, k) at half steps by heights (rows, columns, k) of the nodes."""
        along_y, along_x = (_cubic(n) for n in heights.shape[:2])
        return np.einsum("ai,ijk,bj->abk", along_y, heights, along_x, optimize=True)


def finer_response(layers: EndlessLayers) -> Array:
    """Stencil (2r + 1, 2r + 1, 3) in mm/N of the heights at half steps, with r = `REACH`.

    Entry (r + a, r + b, k) is what the mesh leaves out of the height at the distance
    (a hx / 2, b hy / 2) from a node on which a force acts along axis k; hx and hy are the cells.
    The heights of the nodes are interpolated by cubic convolution.

    Args:
        layers: Of the pad. Its edges, a crown and cut cells are not taken into account.
    """
    exact, mesh = layers.exact(2)[:, :, 2], layers.mesh[:, :, 2]
    return _near(exact - layers.interpolated(mesh), REACH)


def half_step_response(layers: EndlessLayers) -> Array:
    """Stencils (2, 2, 2r + 1, 2r + 1) in mm/N of normal forces at half steps, with r = `REACH`.

    Entry (u, v, r + a, r + b) is what the mesh leaves out, at the distance (a hx / 2, b hy / 2)
    from the force, of the height under the forces on nodes into which it splits. The force is u
    half steps along x and v along y from a node.

    Args:
        layers: As for `finer_response`.
    """
    normal, loaded = layers.mesh[:, :, 2, 2:], layers.exact(2, nodes_per_cell=2)[:, :, 2, 2:]
    found = np.empty((2, 2, 2 * REACH + 1, 2 * REACH + 1))
    for u, v in np.ndindex(2, 2):
        nodes = [(b, a) for a in range(u + 1) for b in range(v + 1)]
        split = np.mean([np.roll(normal, node, axis=(0, 1)) for node in nodes], axis=0)
        smooth = np.roll(layers.interpolated(split), (-v, -u), axis=(0, 1))
        found[u, v] = _near(loaded - smooth, REACH)[..., 0]
    return found


@dataclass(frozen=True, eq=False)
class NearMotion:
    """What a mesh leaves out of the motion of a disc on the surface, such as a marker.

    The motion of the nodes is interpolated bilinearly.

    Attributes:
        table: (2m + 1, 2m + 1, 3, 3) in mm/N by steps along x and y from a node with a force.
        step_mm: (2,) of the table.
    """

    table: Array
    step_mm: Array

    @classmethod
    def of(cls, layers: EndlessLayers, disc_mm: float) -> NearMotion:
        """Of discs of the radius `disc_mm`; `layers` are as for `finer_response`."""
        exact, mesh = layers.exact(_BETWEEN, disc_mm=disc_mm), layers.mesh
        along_y, along_x = (_linear(n, _BETWEEN) for n in mesh.shape[:2])
        smooth = np.einsum("ai,ijkl,bj->abkl", along_y, mesh, along_x, optimize=True)
        table = _near(exact - smooth, _CELLS * _BETWEEN)
        return cls(table, np.array(layers.cell_mm) / _BETWEEN)

    @cached_property
    def reach_mm(self) -> Array:
        """(2,) distances along x and y within which there is something."""
        return self.step_mm * (len(self.table) // 2)

    def at(self, away_mm: Array) -> Array:
        """Motion (n, 3, 3) at distances (n, 2) within the reach, by forces along each axis."""
        at = (away_mm + self.reach_mm) / self.step_mm
        cell = np.minimum(at.astype(np.intp), len(self.table) - 2)
        found = np.zeros((len(at), 3, 3))
        for corner in np.ndindex(2, 2):
            share = np.abs(1 - np.array(corner) - (at - cell)).prod(axis=1)
            found += share[:, None, None] * self.table[tuple((cell + corner).T)]
        return found


def _near(motion: Array, reach: int) -> Array:
    """(2r + 1, 2r + 1, ...) by steps along x and y, of (rows, columns, ...) about the first."""
    near = np.arange(-reach, reach + 1)
    return np.ascontiguousarray(motion[np.ix_(near, near)].swapaxes(0, 1))


def _cubic(count: int) -> Array:
    """(2 count, count) cubic convolution on a closed line, at its nodes and half way between."""
    found = np.zeros((2 * count, count))
    for node in range(count):
        found[2 * node, node] = 1.0
        for step, weight in ((-1, -1), (0, 9), (1, 9), (2, -1)):
            found[2 * node + 1, (node + step) % count] += weight / 16
    return found


def _linear(count: int, steps: int) -> Array:
    """(steps count, count) linear interpolation on a closed line."""
    at = np.arange(steps * count)
    away = np.abs(at[:, None] / steps - np.arange(count))
    return np.maximum(1 - np.minimum(away, count - away), 0.0)
