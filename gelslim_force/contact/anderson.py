"""Anderson acceleration of a fixed-point iteration."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Anderson:
    """Anderson acceleration of x <- x + step(x) (Walker and Ni 2011, type II)."""

    def __init__(self, depth: int = 4) -> None:
        self.depth = depth
        self.places: list[Array] = []
        self.steps: list[Array] = []

    def next(self, x: Array, step: Array) -> Array:
        """The next x from this one and its plain step."""
        self.places = [*self.places[-self.depth :], x.copy()]
        self.steps = [*self.steps[-self.depth :], step]
        if len(self.steps) == 1:
            return np.asarray(x + step)
        change = np.diff(np.array(self.steps), axis=0).T
        moved = np.diff(np.array(self.places), axis=0).T
        weights = np.linalg.lstsq(change, step, rcond=None)[0]
        return np.asarray(x + step - (moved + change) @ weights)
