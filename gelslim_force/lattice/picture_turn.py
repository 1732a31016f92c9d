"""Whether a picture is turned or mirrored, from the places of its dots."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

_ORIENTATIONS = {
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
    """Return how the picture is turned or mirrored; empty if it is upright.

    `expected_px` (n, 2) are the positions of the dots by the design, `seen_px` (n, 2) those in
    the picture. The affine map between them is compared with the eight turns and mirror images of
    the picture; small rotations and changes of scale have no effect.
    """
    expected, seen = (np.asarray(v, dtype=float) for v in (expected_px, seen_px))
    apart = expected - expected.mean(axis=0)
    affine = np.linalg.lstsq(apart, seen - seen.mean(axis=0), rcond=None)[0].T
    fits = {k: float((affine * np.array(k).reshape(2, 2)).sum()) for k in _ORIENTATIONS}
    return _ORIENTATIONS[max(fits, key=lambda k: fits[k])]
