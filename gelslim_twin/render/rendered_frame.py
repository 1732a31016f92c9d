"""A frame with the truth that it was drawn from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class RenderedFrame:
    """Picture (h, w, 3) uint8, red first, and the dots in it, in the print's order."""

    image: NDArray[np.uint8]
    centres_px: NDArray[np.float64]
    """(m, 2) centroids of the dots' images, mean over the open shutter; pixel centres integers."""
    diameter_px: NDArray[np.float64]
    """(m,) of the disc of the same area."""
    drawn: NDArray[np.bool_]
    """(m,) whether the dot is printed and its whole outline lies in the picture."""
