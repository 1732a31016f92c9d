"""Figures by which fingers are compared, and Pareto-optimal designs.

A design is Pareto-optimal if no other one is at least as good in every figure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

DIGITS = 4


@dataclass(frozen=True)
class Figure:
    """A number by which fingers are compared, and which way it is better: `one` is near to 1."""

    name: str
    words: str
    unit: str
    better: Literal["less", "more", "one", ""]

    @property
    def wish(self) -> str:
        """Whether a smaller or a larger value is better, in words."""
        return "nearer to 1" if self.better == "one" else self.better

    def costs(self, values: Sequence[float]) -> list[float]:
        """The values as numbers to make small: of a ratio 0.8 is as far off as 1.25."""
        if self.better == "one":
            return [max(v, 1 / v) for v in values]
        return [-v if self.better == "more" else v for v in values]


THICKNESS = Figure("finger.thickness_mm", "finger thickness", "mm", "less")
KEYSTONE = Figure("view.keystone", "keystone", "", "one")
BLUR = Figure("view.far_blur_mm", "blur at the far edge", "mm", "less")
BRIGHTNESS = Figure("light.irradiance_uw_mm2", "brightness on the coat", "µW/mm²", "more")
EXPOSURE = Figure("light.exposure_ms", "exposure", "ms", "less")
FORCE_ERROR = Figure("force.error", "expected force error", "", "less")
FIGURES = (
    THICKNESS,
    Figure("finger.length_mm", "finger length", "mm", "less"),
    Figure("finger.width_mm", "finger width", "mm", "less"),
    Figure("gel.area_mm2", "gel length × width", "mm²", "more"),
    KEYSTONE,
    BLUR,
    Figure("marker.px", "marker at the far edge, shorter side", "px", "more"),
    BRIGHTNESS,
    EXPOSURE,
    Figure("light.frame_rate_hz", "frame rate", "Hz", "more"),
    FORCE_ERROR,
    Figure("gel.stiffness_n_mm", "gel stiffness against a bump", "N/mm", ""),
)
"""Brightness is of the darker colour, exposure and frame rate of the slower."""
TRADES = (KEYSTONE, BLUR, BRIGHTNESS, FORCE_ERROR)
"""The figures that compete with thickness."""


def front(first: Sequence[float], second: Sequence[float]) -> list[int]:
    """Places on the Pareto front, by rising `first`: no other is as good in both, better in one.

    Both are to be small; `DIGITS` digits count, as the solver stops near its limits. Equal designs
    are all on it.
    """
    x, y = _coarse(first), _coarse(second)
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
