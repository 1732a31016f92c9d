"""Faults of the marker print: displaced, missing and irregular dots."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gelslim_twin.render.printed_dots import PrintedDots
from gelslim_twin.render.random_stream import stream


@dataclass(frozen=True)
class MarkerPrint:
    """Faults of the print: standard deviation of positions per axis, missing and irregular dots.

    Each semi-axis of an irregular dot is drawn between 0.5 and 1.5 times the nominal one.
    """

    jitter_mm: float = 0.0
    missing_percent: float = 0.0
    odd_percent: float = 0.0
    seed: int = 0

    def apply(self, dots: PrintedDots) -> PrintedDots:
        """The print with its faults, each kind from its own random stream."""
        count = len(dots)
        shift = stream(self.seed, "print jitter").standard_normal((count, 2))
        absent = stream(self.seed, "missing dots").random(count) < self.missing_percent / 100
        drawn = stream(self.seed, "odd dots").random((count, 4))
        odd = (drawn[:, 0] < self.odd_percent / 100)[:, None]
        size = np.where(odd, 0.5 + drawn[:, 1:3], 1.0)
        return replace(
            dots,
            centres_mm=dots.centres_mm + self.jitter_mm * shift,
            semi_axes_mm=dots.semi_axes_mm * size,
            turn_rad=np.where(odd[:, 0], np.pi * drawn[:, 3], dots.turn_rad),
            present=dots.present & ~absent,
        )
