"""Whether a picture is turned or mirrored against what the design's camera would take."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
_NAMES = {
    (1, 0, 0, 1): "",
    (0, -1, 1, 0): "turned by 90° clockwise",
    (-1, 0, 0, -1): "turned by 180°",
    (0, 1, -1, 0): "turned by 90° anticlockwise",
    (-1, 0, 0, 1): "mirrored left to right",
    (1, 0, 0, -1): "mirrored top to bottom",
    (0, 1, 1, 0): "transposed",
    (0, -1, -1, 0): "transposed and turned by 180°",
}


def picture_turn(expected_px: ArrayLike, seen_px: ArrayLike) -> str:
    """Return how the picture is turned or mirrored, in words; empty where it is upright.

    `expected_px` (n, 2) are the dots' places by the design, `seen_px` (n, 2) those in the
    picture, x to the right and y down. The affine map between them is compared with the eight
    turns and mirror images of the picture; small rotations and changes of scale do not count.
    """
    expected, seen = (np.asarray(v, dtype=float) for v in (expected_px, seen_px))
    apart = expected - expected.mean(axis=0)
    affine = np.linalg.lstsq(apart, seen - seen.mean(axis=0), rcond=None)[0].T
    fits = {k: float((affine * np.array(k).reshape(2, 2)).sum()) for k in _NAMES}
    return _NAMES[max(fits, key=lambda k: fits[k])]
