"""What a force pipeline asks for the normal motion."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.indenter_source import NormalReading

Array = NDArray[np.float64]


class NormalSource(Protocol):
    """Finds the normal motion of a frame in two steps, as `IndenterSource` does."""

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> Any:
        """What the frame (h, w, 3) shows; its markers are at (n, 2), NaN for lost ones."""

    def motion(self, seen: Any, lateral_mm: Array | None = None) -> NormalReading:
        """Normal motion; `lateral_mm` (2,) is that of the gel where it is touched."""
