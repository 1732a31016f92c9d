"""Whether tracks still agree with the print's anchors: a whole-pitch slip of all markers shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_force.tracking.tracks import Tracks

_STEP = 0.45
"""Change in the logarithm of area against the reference that contradicts: a factor of 1.6."""


def contradictions(
    tracks: Tracks, area_px: NDArray[np.float64], reference_area_px: NDArray[np.float64]
) -> int:
    """Return how many tracked markers have a dot of another size than in the reference.

    `area_px` (m,) of the frame's dots, `reference_area_px` (n,) of the markers. A common change
    (exposure, focus) drops out. A slip by a whole pitch contradicts twice per large anchor.
    """
    seen = np.flatnonzero(tracks.tracked)
    if len(seen) == 0:
        return 0
    change = np.log(area_px[tracks.dots[seen]] / reference_area_px[seen])
    return int((np.abs(change - np.median(change)) > _STEP).sum())


def anchors_slipped(
    tracks: Tracks,
    area_px: NDArray[np.float64],
    reference_area_px: NDArray[np.float64],
    large: NDArray[np.bool_],
) -> bool:
    """Whether most of the large anchors (`large` (n,)) that are tracked lie on ordinary dots."""
    seen = np.flatnonzero(tracks.tracked)
    if len(seen) == 0:
        return False
    change = np.log(area_px[tracks.dots[seen]] / reference_area_px[seen])
    change -= np.median(change)
    shrunk = change[large[seen]] < -_STEP
    return len(shrunk) >= 2 and bool(shrunk.mean() > 0.5)
