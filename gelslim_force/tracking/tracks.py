"""The position of each marker in a frame, and how it is known."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_core.immutable import Immutable, frozen


class MarkerStatus(IntEnum):
    """How the position of a marker is known."""

    TRACKED = 0
    """It was seen, and it moves like its neighbours."""
    PREDICTED = 1
    """It was not seen; its position is predicted from tracked neighbours."""
    LOST = 2
    """Neither it nor enough neighbours were seen; its position is NaN."""
    REJECTED = 3
    """A dot near it contradicts its neighbours; its position is predicted from them, or NaN."""


@dataclass(frozen=True, eq=False)
class Tracks(Immutable):
    """The n markers of the reference in one frame, in its order; arrays are read-only."""

    positions_px: NDArray[np.float64]
    """(n, 2); NaN where unknown."""
    displacement_px: NDArray[np.float64]
    """(n, 2) from the reference; NaN where unknown."""
    status: NDArray[np.int64]
    """(n,) values of `MarkerStatus`."""
    dots: NDArray[np.int64]
    """(n,) index of the dot of each tracked marker; -1 for the others."""

    def __len__(self) -> int:
        """Return the number of markers."""
        return len(self.status)

    @cached_property
    def tracked(self) -> NDArray[np.bool_]:
        """(n,) whether a marker was seen and verified."""
        return frozen(self.status == int(MarkerStatus.TRACKED))

    @cached_property
    def known(self) -> NDArray[np.bool_]:
        """(n,) whether a marker has a position, seen or predicted."""
        return frozen(np.isfinite(self.positions_px[:, 0]) & np.isfinite(self.positions_px[:, 1]))

    @property
    def coverage(self) -> float:
        """Share of the markers that were seen and verified."""
        return float(self.tracked.mean())

    def count(self, status: MarkerStatus) -> int:
        """Return how many markers have a status."""
        return int((self.status == status).sum())

    def without(self, rejected: NDArray[np.bool_]) -> Tracks:
        """The same with the markers `rejected` (n,), whose positions are then unknown."""
        unknown = rejected[:, None]
        return Tracks(
            np.where(unknown, np.nan, self.positions_px),
            np.where(unknown, np.nan, self.displacement_px),
            np.where(rejected, int(MarkerStatus.REJECTED), self.status),
            np.where(rejected, -1, self.dots),
        )
