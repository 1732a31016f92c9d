"""The lattice of an unknown print: which way its rows run on the gel, its steps, its dots."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ifem_export.markers.grid import REGULAR, MarkerGrid
from ifem_export.markers.lattice_frame import LatticeFrame

Array = NDArray[np.float64]
Sites = NDArray[np.int64]
_ROUNDS = 5
_OUTLIER_SIGMAS = 4.5
_LEAST_NOISE_MM = 1e-4
_LARGEST_DOT = 0.95
"""Largest diameter of a dot over the smallest distance of two: a picture out of focus shows larger
ones."""


def picture_directions(x_points: str, mirrored: bool) -> Array:
    """Unit vectors (2, 2) of the gel's x and y in the picture, as rows; rows of pixels run down.

    The camera looks along z, out of the gel: with x to the right, y points down, and up in a
    mirrored picture.
    """
    along = {"right": (1, 0), "down": (0, 1), "left": (-1, 0), "up": (0, -1)}[x_points]
    across = np.array([-along[1], along[0]]) * (-1 if mirrored else 1)
    return np.array([along, across], dtype=float)


def turned_sites(sites: Sites, steps: Array) -> Sites:
    """Sites (k, 2) with rows that follow x and columns that follow y, from 0.

    Args:
        sites: Of a lattice whose origin, orientation and handedness are arbitrary.
        steps: (2, 2) the steps along its rows and its columns as rows, with components along the
            gel's x and y.
    """
    unit = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    straight = abs(unit[0, 0]) + abs(unit[1, 1]) >= abs(unit[0, 1]) + abs(unit[1, 0])
    order = [0, 1] if straight else [1, 0]
    signs = np.sign([unit[order[0], 0], unit[order[1], 1]]).astype(np.int64)
    turned: Sites = sites[:, order] * np.where(signs == 0, 1, signs)
    return turned - turned.min(axis=0)


def fitted_frame(sites: Sites, positions_mm: Array) -> tuple[LatticeFrame, NDArray[np.bool_]]:
    """The lattice through most of the positions (k, 2), and which (k,) belong to it.

    Dirt that counts as a dot lies off the lattice; it is left out in rounds.
    """
    shape = lattice_shape(sites)
    used = np.ones(len(sites), dtype=bool)
    frame = LatticeFrame.fitted(sites, positions_mm, shape)
    for _ in range(_ROUNDS):
        off = positions_mm - frame.places_mm(sites, shape)
        noise = max(1.4826 * float(np.median(np.abs(off))), _LEAST_NOISE_MM)
        used = np.hypot(*off.T) <= _OUTLIER_SIGMAS * noise
        frame = LatticeFrame.fitted(sites[used], positions_mm[used], shape)
    return frame, used


def lattice_shape(sites: Sites) -> tuple[int, int]:
    """Rows and columns of sites (k, 2) that begin at 0."""
    rows, columns = sites.max(axis=0) + 1
    return int(rows), int(columns)


def moved_frame(frame: LatticeFrame, shift_mm: Array) -> LatticeFrame:
    """The lattice with another middle."""
    return LatticeFrame(frame.row_step_mm, frame.column_step_mm, frame.middle_mm + shift_mm)


def grid_of(
    sites: Sites, frame: LatticeFrame, shape: tuple[int, int], diameter_mm: float
) -> tuple[MarkerGrid, Sites]:
    """The print with dots at these sites, and their order in it.

    Args:
        sites: (k, 2) sites of a lattice of `shape`; some rows or columns may have no dot left.
        frame: Of the lattice.
        shape: Its rows and columns.
        diameter_mm: Of the dots.

    Returns:
        The print, and for each of its markers the number (k,) among the sites.
    """
    first = sites.min(axis=0)
    own = sites - first
    order = np.lexsort((own[:, 1], own[:, 0]))
    kept = lattice_shape(own)
    # The middle of the rows and columns that are left is another one.
    middle = frame.places_mm((first + (np.array(kept) - 1) / 2)[None], shape)[0]
    own_frame = LatticeFrame(frame.row_step_mm, frame.column_step_mm, middle)
    own = own[order]
    gap = min(*frame.pitches_mm, *frame.diagonals_mm)
    grid = MarkerGrid(
        positions_mm=own_frame.places_mm(own, kept),
        row=own[:, 0],
        column=own[:, 1],
        diameter_mm=np.full(len(own), min(diameter_mm, _LARGEST_DOT * gap)),
        kind=np.full(len(own), REGULAR),
        pitch_mm=float(np.mean(frame.pitches_mm)),
        lattice_shape=kept,
        omitted=np.zeros((0, 2), dtype=np.int64),
        frame=own_frame,
    )
    return grid, order
