"""Specular reflections of the lamps in the window: bright spots that do not move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.render.random_stream import stream


@dataclass(frozen=True)
class Specular:
    """Number of spots with up to `level_dn` grey values and about `radius_px`, in lamp colours.

    Raises ValueError for values out of range.
    """

    spots: int = 0
    level_dn: float = 200.0
    radius_px: float = 2.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.spots <= 10_000:
            raise ValueError(f"{self.spots} specular spots: must be in 0 ... 10000")
        if not (0 <= self.level_dn <= 1e4 and self.radius_px > 0):
            raise ValueError("the spots' level_dn must not be negative, their radius_px positive")

    @property
    def is_null(self) -> bool:
        """Whether there is no spot to see."""
        return self.spots == 0 or self.level_dn == 0

    def glare(self, shape: tuple[int, int], colour: NDArray[np.float64]) -> NDArray[np.float32]:
        """What the spots add (h, w, 3), lamps of `colour` (k, 3); empty if nothing."""
        if self.is_null:
            return np.zeros((0, 0, 3), dtype=np.float32)
        random = stream(self.seed, "specular spots").random((self.spots, 5))
        y, x = np.arange(shape[0])[:, None], np.arange(shape[1])[None, :]
        out = np.zeros((*shape, 3), dtype=np.float32)
        for u, v, size, strength, lamp in random:
            radius = self.radius_px * (0.5 + size)
            away = ((x - u * shape[1]) / radius) ** 2 + ((y - v * shape[0]) / radius) ** 2
            spot = (0.3 + 0.7 * strength) * self.level_dn * np.exp(-(away**2))
            tint = colour[int(lamp * len(colour))]
            tint = 0.5 + 0.5 * tint / max(tint.max(), 1e-12)
            out += (spot[..., None] * tint).astype(np.float32)
        return out
