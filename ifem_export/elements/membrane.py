"""Stiffness of membranes on the outer surface of a pad: coat and fabric.

A membrane resists stretching and shear in its plane, and neither bending nor motion across it. Its
strain energy per area is that of plane stress (Timoshenko and Woinowsky-Krieger 1959, 21),

    N / (2 (1 - ν²)) (εx² + εy² + 2 ν εx εy + (1 - ν)/2 γ²),

with N the stiffness E t, force per width and strain. It is bonded to the gel, so that its elements
are the quadrilaterals of the surface.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ifem_export.elements.skin import Membrane
from ifem_export.errors import MeshError
from ifem_export.mesh.pad_mesh import PadMesh

Array = NDArray[np.float64]
CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
"""Places of a cell's corners along x and y, in the order of a hexahedron's upper face."""
_GAUSS = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3.0)


def quad_stiffness(size_mm: tuple[float, float], membranes: Sequence[Membrane]) -> Array:
    """Stiffness (8, 8) in N/mm of one cell of the surface with all membranes on it.

    The unknowns are the displacements along x and y of the corners in the order of `CORNERS`. The
    integration by 2 x 2 points is exact.
    """
    law = np.zeros((3, 3))
    for one in membranes:
        nu = one.poissons_ratio
        plane = np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, (1 - nu) / 2]])
        law += one.stiffness_n_per_mm / (1 - nu**2) * plane
    hx, hy = size_mm
    found = np.zeros((8, 8))
    for s in _GAUSS:
        for t in _GAUSS:
            along_x = np.where(CORNERS[:, 0], 1.0, -1.0) * np.where(CORNERS[:, 1], t, 1 - t) / hx
            along_y = np.where(CORNERS[:, 1], 1.0, -1.0) * np.where(CORNERS[:, 0], s, 1 - s) / hy
            strain = np.zeros((3, 8))
            strain[0, 0::2] = strain[2, 1::2] = along_x
            strain[1, 1::2] = strain[2, 0::2] = along_y
            found += strain.T @ law @ strain * (hx * hy / 4)
    return found


def membrane_stiffness(mesh: PadMesh, membranes: Sequence[Membrane]) -> sparse.csr_array:
    """Stiffness (3c, 3c) in N/mm of membranes on the c surface nodes of a flat pad.

    Cells that the pad's outline cuts count by their fill. Raises MeshError for a crowned pad.
    """
    if mesh.surface_shift is not None:
        raise MeshError(
            "the pad is crowned: a membrane on it is implemented for flat pads only; set "
            "design.gel.crown_height_mm to 0 or remove coat and fabric",
            field="mesh",
        )
    cells = np.asarray(mesh.occupancy)[:, :, -1].T
    corners = np.asarray(mesh.hexes)[-int(cells.sum()) :, 4:]
    nodes = np.searchsorted(np.asarray(mesh.surface), corners)
    fill = np.ones(len(nodes)) if mesh.fill is None else np.asarray(mesh.fill)[:, :, -1].T[cells]
    element = quad_stiffness(mesh.cell_size_mm[:2], membranes)
    unknowns = (3 * nodes[:, :, None] + np.arange(2)).reshape(-1, 8)
    rows, columns = np.repeat(unknowns, 8, axis=1), np.tile(unknowns, (1, 8))
    values = fill[:, None] * element.ravel()
    size = 3 * len(mesh.surface)
    return sparse.csr_array(
        sparse.coo_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))
    )


def with_skin(pad: sparse.csr_array, skin: sparse.csr_array) -> sparse.csr_array:
    """Stiffness (n, n) of a pad's free nodes, the surface last, with `skin` (3c, 3c) added.

    The places of the entries stay those of the pad, which are symmetric: sums that happen to be
    zero are kept.
    """
    size, first = pad.shape[0], pad.shape[0] - skin.shape[0]
    found = sparse.csr_array(pad)
    found.sort_indices()
    rows = np.repeat(np.arange(size, dtype=np.int64), np.diff(found.indptr))
    added = skin.tocoo()
    row, column = (first + np.asarray(at, dtype=np.int64) for at in added.coords)
    at = np.searchsorted(rows * size + found.indices, row * size + column)
    data = found.data.copy()
    data[at] += added.data
    return sparse.csr_array((data, found.indices, found.indptr), shape=pad.shape)


def membrane_blocks(
    size_mm: tuple[float, float], membranes: Sequence[Membrane], shape: tuple[int, int]
) -> Array:
    """As `membrane_symbol`, for all ky of the lattice."""
    half = membrane_symbol(size_mm, membranes, shape)
    # A wave along -y is the mirror image of one along y.
    mirrored = half[-2:0:-1] * np.array([[1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, 1.0]])
    return np.concatenate([half, mirrored])


def membrane_symbol(
    size_mm: tuple[float, float], membranes: Sequence[Membrane], shape: tuple[int, int]
) -> Array:
    """Stiffness (ky >= 0, kx >= 0, 3, 3) in N/mm of endless membranes on a lattice.

    A wave exp(i k x) of the nodes needs these forces per node; they are real.

    Args:
        size_mm: Cell along x and y.
        membranes: The membranes.
        shape: Size (rows, columns) of the periodic lattice, both even.
    """
    element = quad_stiffness(size_mm, membranes).reshape(4, 2, 4, 2)
    phase_y = 2 * np.pi * np.arange(shape[0] // 2 + 1) / shape[0]
    phase_x = 2 * np.pi * np.arange(shape[1] // 2 + 1) / shape[1]
    found = np.zeros((len(phase_y), len(phase_x), 3, 3))
    for a in range(4):
        for b in range(4):
            dx, dy = CORNERS[b] - CORNERS[a]
            # The imaginary parts cancel over the element, which is its own mirror image.
            wave = np.cos(dy * phase_y[:, None] + dx * phase_x)
            found[..., :2, :2] += wave[..., None, None] * element[a, :, b, :]
    return found
