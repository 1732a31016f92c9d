"""The true normal motion and contact as the pipeline's normal source."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.normal_source import NormalReading
from gelslim_twin.contact.gel_state import GelState

Array = NDArray[np.float64]


class KnownContact:
    """Gives one state per frame, in their order."""

    def __init__(self, states: Iterable[GelState]) -> None:
        self._left: Iterator[GelState] = iter(states)

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> GelState:
        """The frame's state. Raises StopIteration beyond the last."""
        return next(self._left)

    def motion(
        self, seen: GelState, lateral_mm: NDArray[np.float64] | None = None
    ) -> NormalReading:
        """True heights, without doubt, and the nodes truly touched."""
        w = seen.displacement_mm[:, 2]
        return NormalReading(w, np.zeros(len(w)), seen.touch > 0)
