"""Designs that no other design beats in every respect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Goal:
    """A column to make small, or large where `larger`."""

    column: str
    words: str
    unit: str = ""
    larger: bool = False


THICKNESS = Goal("finger.thickness_mm", "thickness", "mm")
TRADES = (
    Goal("view.keystone", "keystone"),
    Goal("view.far_blur_mm", "blur at the far edge", "mm"),
    Goal("light.irradiance_uw_mm2", "brightness on the coat", "µW/mm²", larger=True),
    Goal("force.error", "expected force error"),
)
"""What thickness is traded against."""


def front(first: Sequence[float], second: Sequence[float], *, larger: bool = False) -> list[int]:
    """Places on the Pareto front, by rising `first`: no other is as good in both, better in one.

    `first` is to be small, `second` small or, where `larger`, large. Equal designs are all on it.
    """
    x = np.asarray(first, dtype=float)
    y = np.asarray(second, dtype=float) * (-1.0 if larger else 1.0)
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


def on_front(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which of the points (n, m), every column to be small, no other point dominates."""
    kept = np.ones(len(points), bool)
    for k, point in enumerate(points):
        beats = np.all(points <= point, axis=1) & np.any(points < point, axis=1)
        kept[k] = not beats.any()
    return kept
