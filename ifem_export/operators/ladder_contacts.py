"""Contacts whose forces are known, with which the ladder of surface operators is measured.

Forces are given on the surface of a finer mesh, its motion follows, and an operator of the coarser
pad is asked for the forces that belong to this motion at its nodes. A small ball presses with
Hertz's pressure, p ~ √(1 - r²/a²), and a sharp punch with that of a rigid flat one, 1/√(1 - r²/a²),
which has no bound at its rim (Johnson, Contact Mechanics, 1985, sections 4.2 and 3.8). The radius a
is that of the smallest contact which the pad can be expected to resolve.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
THICKNESSES, CELLS = 0.75, 2.25
"""Radius of a contact: the larger of these shares of the thickness and of a cell."""
DIRECTION = np.array([0.3, 0.1, -1.0])
POINTS = 4000
GOLDEN_ANGLE_RAD = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True, eq=False)
class Disc:
    """Pressure on a disc.

    Attributes:
        centre_mm: (2,).
        radius_mm: Radius of the disc.
        force_n: (3,) resultant, if the disc lies on the pad.
        is_sharp: Whether the pressure is that of a flat punch instead of a ball.
    """

    centre_mm: Array
    radius_mm: float
    force_n: Array
    is_sharp: bool = False

    def points_mm(self) -> Array:
        """Points (`POINTS`, 2) of equal force, on a sunflower spiral.

        The force within r is 1 - (1 - r²/a²)^(3/2) of a ball's, and 1 - (1 - r²/a²)^(1/2) of a
        punch's.
        """
        k = np.arange(POINTS)
        beyond = 1.0 - (k + 0.5) / POINTS
        r = self.radius_mm * np.sqrt(1.0 - beyond ** (2.0 if self.is_sharp else 2.0 / 3.0))
        angle = k * GOLDEN_ANGLE_RAD
        return self.centre_mm + r[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def standard_contacts(mesh: PadMesh) -> Mapping[str, tuple[Disc, ...]]:
    """Contacts by name: small_ball, sharp_punch, edge, two_contacts.

    The one at the edge is a ball whose disc reaches two thirds of its radius beyond the pad.
    """
    points = np.asarray(mesh.surface_mm)[:, :2]
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, (high - low) / 2
    thickness_mm = mesh.layers * mesh.cell_size_mm[2]
    a = max(THICKNESSES * thickness_mm, CELLS * max(mesh.cell_size_mm[:2]))
    outermost = points[np.argmax(points[:, 0] - 1e-6 * np.abs(points[:, 1] - middle[1]))]
    aside = np.array([1.75 * a, 0.3 * a])
    lighter = np.array([-0.3, 0.1, -0.5])
    return {
        "small_ball": (Disc(middle + [0.22, -0.16] * half, a, DIRECTION),),
        "sharp_punch": (Disc(middle + [-0.25, 0.2] * half, a, DIRECTION, is_sharp=True),),
        "edge": (Disc(outermost - [a / 3, 0.0], a, DIRECTION),),
        "two_contacts": (Disc(middle - aside, a, DIRECTION), Disc(middle + aside, a, lighter)),
    }


def surface_positions(mesh: PadMesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Lattice rows and columns of the surface nodes."""
    numbering = mesh.numbering
    _, j, i = np.unravel_index(numbering.positions[mesh.surface], numbering.shape)
    return j, i


def nodal_forces(mesh: PadMesh, discs: tuple[Disc, ...]) -> Array:
    """Forces (c, 3) in N on the surface nodes, by the bilinear functions of their cells.

    What lies beyond the pad does not press.
    """
    rows, columns = surface_positions(mesh)
    number = np.full(tuple(n + 1 for n in mesh.numbering.shape[1:]), -1)
    number[rows, columns] = np.arange(len(rows))
    force = np.zeros((len(rows), 3))
    for disc in discs:
        place = (disc.points_mm() - mesh.origin_mm[:2]) / mesh.cell_size_mm[:2]
        cell = np.clip(np.floor(place).astype(int), 0, np.array(mesh.numbering.shape[:0:-1]) - 1)
        x, y = (place - cell).T
        inside = (place - cell >= 0).all(axis=1) & (place - cell <= 1).all(axis=1)
        corners = [number[cell[:, 1] + dy, cell[:, 0] + dx] for dy in (0, 1) for dx in (0, 1)]
        inside &= (np.stack(corners) >= 0).all(axis=0)
        shares = ((1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y)
        for corner, share in zip(corners, shares, strict=True):
            np.add.at(force, corner[inside], share[inside, None] * disc.force_n / POINTS)
    return force


def contact_motions(
    operator: SurfaceOperator, fine: PadMesh, coarse: PadMesh, forces: list[Array]
) -> list[Array]:
    """Motions (c, 3) in mm of the coarse surface nodes under forces on the fine ones."""
    nearest = cKDTree(np.asarray(fine.surface_mm)[:, :2]).query(coarse.surface_mm[:, :2])[1]
    return [operator.displacement(force)[nearest] for force in forces]
