"""What the detector must know about the dots: their sizes, shape and contrast."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

DotShape = Literal["round", "double"]
"""One dot per marker, or two dots side by side that count as one marker."""


@dataclass(frozen=True)
class DetectorSettings:
    """Settings of the detector. Raises ValueError for values with which no dot can be found."""

    smallest_diameter_px: float = 3.0
    largest_diameter_px: float = 24.0
    """Extent of the largest dot, with both halves of a double one."""
    least_contrast: float = 0.12
    """Least darkness of a dot relative to the light around it."""
    shape: DotShape = "round"
    weight_from: float = 0.25
    weight_to: float = 1.0
    """Shares of a dot's darkness between which the weight of a pixel rises from 0 to 1."""

    def __post_init__(self) -> None:
        if not 1.0 <= self.smallest_diameter_px < self.largest_diameter_px <= 400.0:
            raise ValueError(
                f"dot diameters from {self.smallest_diameter_px:g} to "
                f"{self.largest_diameter_px:g} px: need 1 <= smallest < largest <= 400"
            )
        if not 0.01 <= self.least_contrast < 0.9:
            raise ValueError(f"least_contrast = {self.least_contrast:g}: must be in 0.01 ... 0.9")
        if self.shape not in ("round", "double"):
            raise ValueError(f"dot shape = {self.shape!r}: must be 'round' or 'double'")
        if not 0.0 <= self.weight_from < self.weight_to <= 1.0:
            raise ValueError(
                f"weights rise from {self.weight_from:g} to {self.weight_to:g}: "
                "need 0 <= from < to <= 1"
            )

    @classmethod
    def for_diameters(
        cls, diameters_px: NDArray[np.float64], shape: DotShape = "round"
    ) -> DetectorSettings:
        """Return settings for dots of these extents (n,), from a third less to a third more.

        Raises ValueError if no diameter is finite.
        """
        sizes = np.asarray(diameters_px, dtype=float)
        sizes = sizes[np.isfinite(sizes)]
        if len(sizes) == 0:
            raise ValueError("no finite dot diameter to set the detector for")
        return cls(
            smallest_diameter_px=max(1.0, 0.67 * float(sizes.min())),
            largest_diameter_px=min(400.0, 1.33 * float(sizes.max()) + 2.0),
            shape=shape,
        )
