"""Pareto-optimal designs: no other design is at least as good in every goal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

DIGITS = 4


@dataclass(frozen=True)
class Goal:
    """A column to make small, large where `larger`, or near one where it is a `ratio`."""

    column: str
    words: str
    unit: str = ""
    larger: bool = False
    ratio: bool = False

    @property
    def better(self) -> str:
        """Whether a smaller or a larger value is better, in words."""
        return "nearer to 1" if self.ratio else "more" if self.larger else "less"

    def costs(self, values: Sequence[float]) -> list[float]:
        """The column as numbers to make small: of a ratio 0.8 is as far off as 1.25."""
        if self.ratio:
            return [max(v, 1 / v) for v in values]
        return [-v if self.larger else v for v in values]


THICKNESS = Goal("finger.thickness_mm", "thickness", "mm")
TRADES = (
    Goal("view.keystone", "keystone", ratio=True),
    Goal("view.far_blur_mm", "blur at the far edge", "mm"),
    Goal("light.irradiance_uw_mm2", "brightness on the coat", "µW/mm²", larger=True),
    Goal("force.error", "expected force error"),
)
"""The goals that compete with thickness."""


def front(first: Sequence[float], second: Sequence[float], *, larger: bool = False) -> list[int]:
    """Places on the Pareto front, by rising `first`: no other is as good in both, better in one.

    `first` is to be small, `second` small or, where `larger`, large; `DIGITS` digits count, as the
    solver stops near its limits. Equal designs are all on it.
    """
    x = _coarse(first)
    y = _coarse(second) * (-1.0 if larger else 1.0)
    order = np.lexsort((y, x))
    found: list[int] = []
    best, best_x = np.inf, np.nan
    for k in order:
        if y[k] < best:
            best, best_x = y[k], x[k]
            found.append(int(k))
        elif y[k] == best and x[k] == best_x:
            found.append(int(k))
    return found


def _coarse(values: Sequence[float]) -> NDArray[np.float64]:
    return np.array([float(f"{v:.{DIGITS}g}") for v in values])
