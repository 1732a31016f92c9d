"""A ball pressed on a disc of gel, by axisymmetric finite elements: truth for the calibrations.

Eight-node quadrilaterals with 2 x 2 Gauss points in (r, z), bonded below, free outside; the disc is
20 mm in radius. A skin is a membrane of line elements on the surface, with the same shape functions
as their cells. Ring after ring of surface nodes comes to rest on the ball, without friction or
sticking where it touches. It shares nothing with the force pipeline, neither elements nor closed
forms.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

Array = NDArray[np.float64]
DISC_MM, FINE_MM, STEP_MM = 20.0, 4.2, 0.1
SKIN_RATIO = 0.3
"""Poisson's ratio of the skin."""
_GAUSS = 1 / np.sqrt(3)
_CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
_MIDDLES = np.array([(0, -1), (1, 0), (0, 1), (-1, 0)], dtype=float)


@dataclass(frozen=True, eq=False)
class PressedDisc:
    """Motion of the surface under the ball at several radii of contact, for E = 1 MPa.

    Attributes:
        r_mm: (n,) surface nodes.
        contact_mm: (s,) radius of contact of each state.
        force_n: (s,) force over Young's modulus in MPa.
        outward_mm: (s, n) radial motion.
        height_mm: (s, n) motion along z.
    """

    r_mm: Array
    contact_mm: Array
    force_n: Array
    outward_mm: Array
    height_mm: Array

    def at_force(self, force_n: float) -> tuple[float, Array, Array]:
        """Radius of contact, and motions (n,) of the nodes, at a force over Young's modulus."""
        radius = float(np.interp(force_n, self.force_n, self.contact_mm))
        parts = [
            np.array([np.interp(force_n, self.force_n, column) for column in field.T])
            for field in (self.outward_mm, self.height_mm)
        ]
        return radius, parts[0], parts[1]


@cache
def pressed_disc(
    ball_mm: float,
    thickness_mm: float,
    poissons_ratio: float,
    sticking: bool = False,
    skin_mm: float = 0.0,
) -> PressedDisc:
    """All states up to a contact of `FINE_MM` less a few steps.

    `skin_mm` is the membrane stiffness N = E t of a skin over Young's modulus of the gel.
    """
    r, surface = surface_stiffness(thickness_mm, poissons_ratio)
    if skin_mm:
        surface[0::2, 0::2] += membrane_stiffness(r, skin_mm)
    count = len(r)
    profile = ball_mm - np.sqrt(np.maximum(ball_mm**2 - r * r, 0.0))
    free = np.arange(1, 2 * count)
    motion = np.zeros(2 * count)
    depth, states = 0.0, []
    rings = int(np.searchsorted(r, min(FINE_MM - 4 * STEP_MM, 0.8 * ball_mm)))
    for ring in range(rings):
        held = 2 * np.arange(ring + 1) + 1
        if sticking:
            held = np.concatenate([held, 2 * np.arange(1, ring + 1)])
        given = np.where(held % 2 == 1, -1.0, 0.0)
        loose = np.setdiff1d(free, held)
        step = np.zeros(2 * count)
        step[held] = given
        step[loose] = -np.linalg.solve(
            surface[np.ix_(loose, loose)], surface[np.ix_(loose, held)] @ given
        )
        # The next ring touches where depth - profile + its height is zero.
        following = 2 * (ring + 1) + 1
        gap = motion[following] - (profile[ring + 1] - depth)
        size = -gap / (step[following] + 1.0)
        motion, depth = motion + size * step, depth + size
        force = -float((surface @ motion)[1::2][: ring + 1].sum())
        states.append((r[ring + 1], force, motion[0::2].copy(), motion[1::2].copy()))
    parts = [np.array(part) for part in zip(*states, strict=True)]
    return PressedDisc(r, *parts)


def surface_stiffness(thickness_mm: float, poissons_ratio: float) -> tuple[Array, Array]:
    """Radii (n,) of the surface nodes and their stiffness (2n, 2n), radial and axial in turn."""
    inner = np.arange(0, FINE_MM + 1e-9, 2 * STEP_MM)
    outer = FINE_MM + (DISC_MM - FINE_MM) * np.linspace(0, 1, 31)[1:] ** 1.6
    radii = np.concatenate([inner, outer])
    levels = -thickness_mm * np.linspace(1, 0, 15) ** 1.5
    points, cells, top = _lattice(radii, levels)
    stiffness = _assembled(points, cells, poissons_ratio)
    bonded = np.flatnonzero(np.isclose(points[:, 1], -thickness_mm))
    on_axis = np.flatnonzero(np.isclose(points[:, 0], 0))
    own = np.column_stack([2 * top, 2 * top + 1]).ravel()
    fixed = np.concatenate([2 * bonded, 2 * bonded + 1, 2 * on_axis])
    inside = np.setdiff1d(np.arange(2 * len(points)), np.concatenate([own, fixed]))
    coupling = stiffness[inside][:, own].toarray()
    solved = splu(sparse.csc_array(stiffness[inside][:, inside])).solve(coupling)
    return points[top, 0], stiffness[own][:, own].toarray() - coupling.T @ solved


def membrane_stiffness(r_mm: Array, skin_mm: float) -> Array:
    """Radial stiffness (n, n) of a membrane on the surface nodes, for a gel of E = 1 MPa.

    Energy of plane stress, N / (2 (1 - ν²)) (εr² + εt² + 2 ν εr εt) with εr = u', εt = u/r, over
    the rings of cells of three nodes.
    """
    nu = SKIN_RATIO
    law = skin_mm / (1 - nu**2) * np.array([[1.0, nu], [nu, 1.0]])
    found = np.zeros((len(r_mm), len(r_mm)))
    points, weights = np.polynomial.legendre.leggauss(3)
    for first in range(0, len(r_mm) - 1, 2):
        own = slice(first, first + 3)
        half = (r_mm[first + 2] - r_mm[first]) / 2
        for xi, weight in zip(points, weights, strict=True):
            shape = np.array([xi * (xi - 1) / 2, 1 - xi * xi, xi * (xi + 1) / 2])
            slope = np.array([xi - 0.5, -2 * xi, xi + 0.5]) / half
            radius = shape @ r_mm[own]
            strain = np.vstack([slope, shape / radius])
            found[own, own] += 2 * np.pi * radius * weight * half * strain.T @ law @ strain
    return found


def _lattice(radii: Array, levels: Array) -> tuple[Array, Array, Array]:
    """Nodes (n, 2), cells (m, 8) and the surface nodes of a lattice of eight-node cells."""
    across = np.interp(np.arange(2 * len(radii) - 1) / 2, np.arange(len(radii)), radii)
    up = np.interp(np.arange(2 * len(levels) - 1) / 2, np.arange(len(levels)), levels)
    i, j = np.meshgrid(np.arange(len(across)), np.arange(len(up)), indexing="ij")
    real = (i % 2 == 0) | (j % 2 == 0)
    number = np.full(i.shape, -1)
    number[real] = np.arange(real.sum())
    points = np.column_stack([across[i[real]], up[j[real]]])
    corner_i, corner_j = (2 * n.ravel() for n in np.meshgrid(
        np.arange(len(radii) - 1), np.arange(len(levels) - 1), indexing="ij"))  # fmt: skip
    offsets = np.vstack([_CORNERS, _MIDDLES]).astype(int) + 1
    cells = np.column_stack([number[corner_i + a, corner_j + b] for a, b in offsets])
    return points, cells, number[:, -1]


def _assembled(points: Array, cells: Array, poissons_ratio: float) -> sparse.csr_array:
    """Stiffness for E = 1 MPa, with forces summed around the whole ring."""
    nu = poissons_ratio
    lame, shear = nu / ((1 + nu) * (1 - 2 * nu)), 1 / (2 * (1 + nu))
    law = lame * np.array([[1, 1, 1, 0]] * 3 + [[0] * 4]) + shear * np.diag([2, 2, 2, 1.0])
    total = np.zeros((len(cells), 16, 16))
    for xi in (-_GAUSS, _GAUSS):
        for eta in (-_GAUSS, _GAUSS):
            shape, slope = _shape(xi, eta)
            corner = points[cells]
            jacobian = np.einsum("dk,mkc->mdc", slope, corner)
            by_place = np.linalg.solve(jacobian, np.broadcast_to(slope, (len(cells), 2, 8)))
            r = corner[:, :, 0] @ shape
            strain = np.zeros((len(cells), 4, 16))
            strain[:, 0, 0::2] = strain[:, 3, 1::2] = by_place[:, 0]
            strain[:, 1, 1::2] = strain[:, 3, 0::2] = by_place[:, 1]
            strain[:, 2, 0::2] = shape / r[:, None]
            weight = 2 * np.pi * r * np.linalg.det(jacobian)
            total += np.einsum("m,mai,ab,mbj->mij", weight, strain, law, strain)
    unknowns = np.stack([2 * cells, 2 * cells + 1], axis=2).reshape(len(cells), 16)
    rows = np.repeat(unknowns, 16, axis=1).ravel()
    columns = np.tile(unknowns, (1, 16)).ravel()
    size = 2 * len(points)
    return sparse.csr_array((total.ravel(), (rows, columns)), shape=(size, size))


def _shape(xi: float, eta: float) -> tuple[Array, Array]:
    """Shape functions (8,) of the serendipity cell and their derivatives (2, 8)."""
    a, b = _CORNERS.T
    corner = (1 + a * xi) * (1 + b * eta) * (a * xi + b * eta - 1) / 4
    corner_xi = a * (1 + b * eta) * (2 * a * xi + b * eta) / 4
    corner_eta = b * (1 + a * xi) * (a * xi + 2 * b * eta) / 4
    flat = np.array([(1 - xi**2) * (1 - eta), (1 + xi) * (1 - eta**2),
                     (1 - xi**2) * (1 + eta), (1 - xi) * (1 - eta**2)]) / 2  # fmt: skip
    flat_xi = np.array([-2 * xi * (1 - eta), 1 - eta**2, -2 * xi * (1 + eta), -(1 - eta**2)]) / 2
    flat_eta = np.array([-(1 - xi**2), -2 * eta * (1 + xi), 1 - xi**2, -2 * eta * (1 - xi)]) / 2
    slopes = np.array([np.concatenate([corner_xi, flat_xi]),
                       np.concatenate([corner_eta, flat_eta])])  # fmt: skip
    return np.concatenate([corner, flat]), slopes
