"""Anderson acceleration of a fixed-point iteration."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Anderson:
    """Anderson acceleration of x <- x + step(x) (Walker and Ni 2011, type II)."""

    def __init__(self, depth: int = 4) -> None:
        self.depth = depth
        self.iterates: list[Array] = []
        self.steps: list[Array] = []

    def next(self, x: Array, step: Array) -> Array:
        """The next x, from this one and its step without acceleration."""
        self.iterates = [*self.iterates[-self.depth :], x.copy()]
        self.steps = [*self.steps[-self.depth :], step]
        if len(self.steps) == 1:
            return np.asarray(x + step)
        step_changes = np.diff(np.array(self.steps), axis=0).T
        x_changes = np.diff(np.array(self.iterates), axis=0).T
        weights = np.linalg.lstsq(step_changes, step, rcond=None)[0]
        return np.asarray(x + step - (x_changes + step_changes) @ weights)
