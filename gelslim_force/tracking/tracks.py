"""Where each marker is in a frame, and how that is known."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class MarkerStatus(IntEnum):
    """How a marker's place is known."""

    TRACKED = 0
    """Seen, and it moves as its neighbours do."""
    PREDICTED = 1
    """Not seen; its place follows from tracked neighbours."""
    LOST = 2
    """Not seen, and too few neighbours are: its place is NaN."""
    REJECTED = 3
    """A dot was near, but contradicts the neighbours; the place is theirs, or NaN."""


@dataclass(frozen=True, eq=False)
class Tracks:
    """n markers in one frame, in the order of the reference; arrays are read-only."""

    positions_px: NDArray[np.float64]
    """(n, 2); NaN where not known."""
    displacement_px: NDArray[np.float64]
    """(n, 2) from the reference; NaN where not known."""
    status: NDArray[np.int64]
    """(n,) values of `MarkerStatus`."""
    dots: NDArray[np.int64]
    """(n,) detection of each tracked marker, -1 for the others."""

    def __post_init__(self) -> None:
        for name in ("positions_px", "displacement_px", "status", "dots"):
            array = np.array(getattr(self, name))
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        """Return the number of markers."""
        return len(self.status)

    @property
    def tracked(self) -> NDArray[np.bool_]:
        """(n,) seen in this frame and verified."""
        return self.status == int(MarkerStatus.TRACKED)

    @property
    def known(self) -> NDArray[np.bool_]:
        """(n,) with a place, seen or predicted."""
        return np.isfinite(self.positions_px[:, 0]) & np.isfinite(self.positions_px[:, 1])

    @property
    def coverage(self) -> float:
        """Share of the markers seen and verified."""
        return float(self.tracked.mean())

    def count(self, status: MarkerStatus) -> int:
        """Return how many markers have a status."""
        return int((self.status == status).sum())
