"""The markers at rest: where each is seen without contact, and which are its neighbours."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_force.detection.detections import Detections
from gelslim_force.lattice.growth import Lattice
from gelslim_force.lattice.registration import Registration
from ifem_export.markers.grid import MarkerGrid

_REACH = 2


@dataclass(frozen=True, eq=False)
class ReferenceLattice:
    """n markers by lattice site, with their places in the no-contact frame.

    Raises ValueError where arrays disagree, a place is not finite, a site is used twice or a
    marker has no neighbour.
    """

    sites: NDArray[np.int64]
    """(n, 2) row and column."""
    positions_px: NDArray[np.float64]
    """(n, 2)."""
    markers: NDArray[np.int64]
    """(n,) id of each in the grid; 0 ... n - 1 where no grid is known."""

    def __post_init__(self) -> None:
        for name, dtype in (
            ("sites", np.int64),
            ("positions_px", np.float64),
            ("markers", np.int64),
        ):
            array = np.array(getattr(self, name), dtype=dtype)
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        count = len(self.markers)
        if self.sites.shape != (count, 2) or self.positions_px.shape != (count, 2):
            raise ValueError(
                f"reference lattice: sites {self.sites.shape} and places {self.positions_px.shape} "
                f"must be ({count}, 2)"
            )
        if count < 9:
            raise ValueError(f"reference lattice: {count} markers are too few to track; min. 9")
        if not np.isfinite(self.positions_px).all():
            raise ValueError("reference lattice: a place is not finite; leave lost markers out")
        if len(np.unique(self.sites, axis=0)) != count:
            raise ValueError("reference lattice: a site is used twice")
        if np.any((self.neighbours < 0).all(axis=1)):
            raise ValueError("reference lattice: a marker stands alone; leave it out")

    def __len__(self) -> int:
        """Return the number of markers."""
        return len(self.markers)

    @cached_property
    def neighbours(self) -> NDArray[np.int64]:
        """(n, 24) indices of the markers up to two sites away, -1 where there is none."""
        low = self.sites.min(axis=0) - _REACH
        table = np.full(tuple(self.sites.max(axis=0) - low + 1 + _REACH), -1, dtype=np.int64)
        table[tuple((self.sites - low).T)] = np.arange(len(self.sites))
        steps = [
            (a, b) for a in range(-_REACH, _REACH + 1) for b in range(-_REACH, _REACH + 1) if a or b
        ]
        steps.sort(key=lambda step: step[0] ** 2 + step[1] ** 2)
        near = [table[tuple((self.sites - low + step).T)] for step in steps]
        return np.column_stack(near)

    @cached_property
    def pitch_px(self) -> NDArray[np.float64]:
        """(n,) distance between neighbours there: the smallest to those one site away.

        Markers without such a neighbour get the median.
        """
        pitch = np.full(len(self), np.inf)
        for k in range(4):
            j = self.neighbours[:, k]
            gap = np.hypot(*(self.positions_px[j] - self.positions_px).T)
            pitch = np.where(j >= 0, np.minimum(pitch, gap), pitch)
        known = np.isfinite(pitch)
        if not known.any():
            raise ValueError("reference lattice: no two markers are neighbours")
        return np.where(known, pitch, np.median(pitch[known]))

    @classmethod
    def from_registration(cls, registration: Registration, grid: MarkerGrid) -> ReferenceLattice:
        """Take the grid's markers that were found."""
        found = np.flatnonzero(registration.found)
        sites = np.column_stack([grid.row, grid.column])[found]
        return _connected(sites, registration.centres_px[found], found)

    @classmethod
    def from_lattice(cls, lattice: Lattice, detections: Detections) -> ReferenceLattice:
        """Take a grown lattice as it is, when no print is known."""
        places = detections.centres_px[lattice.dots]
        return _connected(lattice.sites, places, np.arange(len(places)))


def _connected(sites: ArrayLike, places: ArrayLike, markers: ArrayLike) -> ReferenceLattice:
    """Leave out markers without any neighbour."""
    at, where, ids = np.asarray(sites), np.asarray(places), np.asarray(markers)
    gap = np.abs(at[:, None, :] - at[None, :, :]).max(axis=2)
    keep = ((gap <= _REACH).sum(axis=1)) > 1
    return ReferenceLattice(sites=at[keep], positions_px=where[keep], markers=ids[keep])
