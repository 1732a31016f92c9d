"""Screws: the sizes the finger uses, from ISO 10642 (countersunk) and ISO 4762 (cap head)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SCREW_EDGE_MM = 2.6
"""Distance from the inner face of a side wall to the axis of the nearest screws."""


@dataclass(frozen=True)
class ScrewSize:
    """Diameters and head sizes of one metric thread, mm."""

    thread_mm: float
    pilot_mm: float
    """Hole for a screw that cuts its own thread in plastic."""
    clearance_mm: float
    countersunk_head_mm: float
    countersunk_height_mm: float
    cap_head_mm: float
    cap_height_mm: float


SCREWS = {
    "M1.6": ScrewSize(1.6, 1.3, 1.8, 3.0, 0.96, 3.0, 1.6),
    "M2": ScrewSize(2.0, 1.6, 2.2, 3.8, 1.2, 3.8, 2.0),
    "M2.5": ScrewSize(2.5, 2.05, 2.7, 4.7, 1.5, 4.5, 2.5),
    "M3": ScrewSize(3.0, 2.5, 3.2, 5.5, 1.65, 5.5, 3.0),
    "M4": ScrewSize(4.0, 3.3, 4.3, 7.5, 2.3, 7.0, 4.0),
    "M5": ScrewSize(5.0, 4.2, 5.3, 9.4, 2.8, 8.5, 5.0),
    "M6": ScrewSize(6.0, 5.0, 6.4, 11.3, 3.3, 10.0, 6.0),
}

LENGTHS_MM = (3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0)


def stock_length_mm(longest_mm: float) -> float:
    """Longest stock screw that is no longer than `longest_mm`; the shortest when none is."""
    return float(stock_lengths_mm(longest_mm))


def stock_lengths_mm(longest_mm: float | NDArray[np.float64]) -> NDArray[np.float64]:
    """The same for many lengths at once."""
    lengths = np.asarray(LENGTHS_MM)
    place = np.searchsorted(lengths, np.asarray(longest_mm) + 1e-9, side="right") - 1
    return np.asarray(lengths[np.maximum(place, 0)])
