"""Faults of the marker print: displaced, missing, and odd dots."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gelslim_twin.render.printed_dots import PrintedDots
from gelslim_twin.render.random_stream import stream


@dataclass(frozen=True)
class PrintFaults:
    """Standard deviation of positions per axis, and shares of missing and odd dots.

    Each semi-axis of an odd dot is drawn between 0.5 and 1.5 times the nominal one. Raises
    ValueError for values out of range.
    """

    jitter_mm: float = 0.0
    missing_share: float = 0.0
    odd_share: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.jitter_mm < 10:
            raise ValueError(f"print jitter of {self.jitter_mm} mm: must be in 0 ... 10 mm")
        for name in ("missing_share", "odd_share"):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"{name} = {getattr(self, name)}: must be in 0 ... 1")

    @property
    def is_null(self) -> bool:
        """Whether the print is left perfect."""
        return self.jitter_mm == 0 and self.missing_share == 0 and self.odd_share == 0

    def apply(self, dots: PrintedDots) -> PrintedDots:
        """The print with its faults, each kind from its own random stream."""
        if self.is_null:
            return dots
        count = len(dots)
        shift = stream(self.seed, "print jitter").standard_normal((count, 2))
        absent = stream(self.seed, "missing dots").random(count) < self.missing_share
        drawn = stream(self.seed, "odd dots").random((count, 4))
        odd = (drawn[:, 0] < self.odd_share)[:, None]
        size = np.where(odd, 0.5 + drawn[:, 1:3], 1.0)
        return replace(
            dots,
            centres_mm=dots.centres_mm + self.jitter_mm * shift,
            semi_axes_mm=dots.semi_axes_mm * size,
            turn_rad=np.where(odd[:, 0], np.pi * drawn[:, 3], dots.turn_rad),
            present=dots.present & ~absent,
        )
