"""Separate contacts in a force field, with the force of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

if TYPE_CHECKING:
    from gelslim_force.forces.frame_result import ForceField

Array = NDArray[np.float64]
_GRID = 6
"""Decimals of coordinates in mm that tell nodes apart."""


@dataclass(frozen=True, eq=False)
class PatchForce:
    """The force on one of several separate contacts.

    Attributes:
        nodes: (p,) its nodes among those of the field.
        force_n: (3,) on the gel; z is NaN where the normal motion is unknown.
        torque_nmm: (3,) about the origin; unknown where it needs the normal force.
        centre_of_pressure_mm: (2,); NaN where nothing pushes.
    """

    nodes: NDArray[np.intp]
    force_n: Array
    torque_nmm: Array
    centre_of_pressure_mm: Array


def contact_patches(field: ForceField) -> tuple[PatchForce, ...]:
    """Forces of the separate contacts of a field, the largest normal force first.

    Nodes in contact belong together where they are neighbours along or across the lattice, or
    diagonally. The forces of a known contact sum to that of the wrench but for what is spread over
    the rest of the surface. Where nothing is, because forces act in and beside the contacts only,
    those beside a contact belong to it.

    Args:
        field: Forces with the nodes in contact.

    Returns:
        The contacts; none where nothing touches the gel.
    """
    corner, place = _places(field.points_mm)
    picture = np.zeros(corner, dtype=bool)
    picture[place] = field.contact
    labels, count = ndimage.label(picture, structure=np.ones((3, 3)))
    wide = ndimage.grey_dilation(labels, size=(3, 3))
    number, beside = np.asarray(labels)[place], np.asarray(wide)[place]
    if not field.force_n[beside == 0].any():
        number = np.where(field.force_n.any(axis=1), beside, number)
    found = [_patch(field, np.flatnonzero(number == k + 1)) for k in range(count)]
    return tuple(sorted(found, key=lambda patch: np.nan_to_num(patch.force_n[2])))


def _places(
    points_mm: Array,
) -> tuple[tuple[int, int], tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Shape of the lattice of the nodes (c, 3), and the place of each along x and y."""
    along = [np.unique(np.round(points_mm[:, k], _GRID), return_inverse=True) for k in (0, 1)]
    (x, i), (y, j) = along
    return (len(x), len(y)), (i, j)


def _patch(field: ForceField, nodes: NDArray[np.intp]) -> PatchForce:
    force, points = field.force_n[nodes], field.points_mm[nodes]
    push = np.maximum(-np.nan_to_num(force[:, 2]), 0.0)
    centre = push @ points[:, :2] / push.sum() if push.any() else np.full(2, np.nan)
    return PatchForce(nodes, force.sum(axis=0), np.cross(points, force).sum(axis=0), centre)
