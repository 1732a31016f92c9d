"""What the loads of presses leave over time: creep, drift and hysteresis of a gel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.presses.gel_fit import FittedPress

Array = NDArray[np.float64]
_CLEAR = 2.5
"""Standard deviations from which a trend is told as one."""
_LEAST_PRESSES = 4


@dataclass(frozen=True)
class PressTrends:
    """Trends of load over fitted force.

    Attributes:
        over_time: Relative change over the whole series, and its standard deviation; NaN for fewer
            than four presses. A gel that creeps looks softer in later presses of longer contact.
        timed: Whether the table gives times; otherwise the order of its lines counts.
        unloading: Mean of the presses after a larger load less that of the presses after a smaller
            one, and its standard deviation; NaN where one kind is missing.
    """

    over_time: tuple[float, float]
    timed: bool
    unloading: tuple[float, float]

    def lines(self) -> tuple[str, ...]:
        """What the trends say, in sentences."""
        told = []
        by = "over time" if self.timed else "in the order of the table"
        change, sigma = self.over_time
        if np.isfinite(change):
            meaning = " (creep, drift of the light or of the scale)"
            clear = abs(change) > _CLEAR * sigma
            told.append(
                f"Residual force {by}: {change:+.1%} ± {sigma:.1%} from the first press to the "
                f"last{meaning if clear else ', no clear trend'}."
            )
        apart, sigma = self.unloading
        if np.isfinite(apart):
            clear = abs(apart) > _CLEAR * sigma
            meaning = " (hysteresis)" if clear else ", no clear hysteresis"
            told.append(
                "Residual force after a larger load less that after a smaller one: "
                f"{apart:+.1%} ± {sigma:.1%}{meaning}."
            )
        return tuple(told)


def press_trends(presses: Sequence[FittedPress], sigma: Array) -> PressTrends:
    """Trends of the presses.

    Args:
        presses: n presses in the order of the table.
        sigma: (n,) relative standard deviation of each residual.
    """
    residual = np.array([press.residual for press in presses])
    times = [press.load.time_s for press in presses]
    timed = all(time is not None for time in times)
    at = np.array(times if timed else np.arange(len(presses)), dtype=float)
    order = np.argsort(at, kind="stable")
    force = np.array([press.force_n for press in presses])[order]
    rising = np.diff(force) > 0
    later = order[1:]
    return PressTrends(
        _slope(at, residual, sigma),
        timed,
        _difference(residual[later], sigma[later], ~rising),
    )


def _slope(at: Array, residual: Array, sigma: Array) -> tuple[float, float]:
    span = float(np.ptp(at))
    if len(at) < _LEAST_PRESSES or not span > 0:
        return np.nan, np.nan
    weight = sigma**-2.0
    unit = (at - weight @ at / weight.sum()) / span
    own = float(weight @ unit**2)
    slope = float(weight @ (unit * residual)) / own
    left = residual - weight @ residual / weight.sum() - slope * unit
    scatter = max(1.0, float(weight @ left**2) / (len(at) - 2))
    return slope, float(np.sqrt(scatter / own))


def _difference(residual: Array, sigma: Array, chosen: NDArray[np.bool_]) -> tuple[float, float]:
    if not chosen.any() or chosen.all() or len(residual) < _LEAST_PRESSES:
        return np.nan, np.nan
    parts = []
    for group in (chosen, ~chosen):
        weight = sigma[group] ** -2.0
        parts.append((float(weight @ residual[group] / weight.sum()), 1 / float(weight.sum())))
    spread = max(1.0, float(np.mean((residual / sigma) ** 2)))
    return parts[0][0] - parts[1][0], float(np.sqrt(spread * (parts[0][1] + parts[1][1])))
