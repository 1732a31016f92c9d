"""The markers at rest: their positions without contact, and the neighbours of each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_force.detection.detections import Detections
from gelslim_force.lattice.growth import Lattice

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
_REACH = 2


@dataclass(frozen=True, eq=False)
class ReferenceLattice:
    """n markers by lattice site, with their positions in the frame without contact.

    Raises ValueError if the arrays disagree, a position is not finite, two markers have the same
    site, or a marker has no neighbour.
    """

    sites: NDArray[np.int64]
    """(n, 2) row and column."""
    positions_px: NDArray[np.float64]
    """(n, 2)."""
    markers: NDArray[np.int64]
    """(n,) index of each marker in the grid; 0 ... n - 1 if no grid is known."""

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
                f"reference lattice: sites {self.sites.shape} and positions "
                f"{self.positions_px.shape} "
                f"must be ({count}, 2)"
            )
        if count < 9:
            raise ValueError(f"reference lattice: {count} markers are too few to track; min. 9")
        if not np.isfinite(self.positions_px).all():
            raise ValueError("reference lattice: a position is not finite; leave lost markers out")
        if len(np.unique(self.sites, axis=0)) != count:
            raise ValueError("reference lattice: a site is used twice")
        if np.any((self.neighbours < 0).all(axis=1)):
            raise ValueError("reference lattice: a marker stands alone; leave it out")

    def __len__(self) -> int:
        """Return the number of markers."""
        return len(self.markers)

    @cached_property
    def neighbours(self) -> NDArray[np.int64]:
        """(n, 24) indices of the markers up to two sites away, -1 for a site without a marker.

        The nearest come first, so that the first four are one site away along an axis.
        """
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
        """(n,) smallest distance to the neighbours one site away; the median without such a one.

        Raises:
            ValueError: No two markers are neighbours.
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
    def from_lattice(cls, lattice: Lattice, detections: Detections) -> ReferenceLattice:
        """Return the dots of a lattice whose print is not known."""
        positions = detections.centres_px[lattice.dots]
        return cls.connected(lattice.sites, positions, np.arange(len(positions)))

    @classmethod
    def connected(cls, sites: IntArray, positions_px: Array, markers: IntArray) -> ReferenceLattice:
        """Return the markers that have a neighbour; a marker without one cannot be tracked."""
        gap = np.abs(sites[:, None, :] - sites[None, :, :]).max(axis=2)
        keep = (gap <= _REACH).sum(axis=1) > 1
        return cls(sites=sites[keep], positions_px=positions_px[keep], markers=markers[keep])
