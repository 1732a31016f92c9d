"""What the loads of presses leave over time: creep, drift and hysteresis of a gel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from gelslim_force.presses.gel_fit import FittedPress

Array = NDArray[np.float64]
_BY_CHANCE = 0.0124
"""Probability that scatter alone is told as a trend: that of 2.5 standard deviations."""
_LEAST_PRESSES = 4


@dataclass(frozen=True)
class Trend:
    """A difference of the relative residuals.

    Attributes:
        change: The difference; NaN where it cannot be told.
        sigma: Its standard deviation, by what the residuals leave beside the trend.
        freedom: Number of residuals less that of the values fitted to them.
    """

    change: float = np.nan
    sigma: float = np.nan
    freedom: int = 0

    @property
    def known(self) -> bool:
        """Whether there is a value."""
        return bool(np.isfinite(self.change))

    @property
    def clear(self) -> bool:
        """Whether scatter is no explanation, by Student's distribution."""
        if not self.known:
            return False
        least = float(stdtrit(self.freedom, 1 - _BY_CHANCE / 2))
        return abs(self.change) > least * self.sigma


@dataclass(frozen=True)
class PressTrends:
    """Trends of load over fitted force.

    Attributes:
        over_time: Change over the whole series. A gel that creeps looks softer in later presses of
            longer contact.
        timed: Whether the table gives times; otherwise the order of its lines counts.
        unloading: Mean of the presses after a larger load less that of the presses after a smaller
            one.
    """

    over_time: Trend
    timed: bool
    unloading: Trend

    @property
    def modulus_sigma(self) -> float:
        """Relative standard deviation of the modulus by clear trends.

        The modulus is that of the middle of the series, and the mean of loading and unloading. One
        that changes evenly over the series deviates from it by the change over the root of 12, one
        that has two values by half their difference. A series to and fro has both in one, so that
        the larger counts.
        """
        by_time = abs(self.over_time.change) / np.sqrt(12) if self.over_time.clear else 0.0
        by_path = abs(self.unloading.change) / 2 if self.unloading.clear else 0.0
        return float(max(by_time, by_path))

    def lines(self) -> tuple[str, ...]:
        """What the trends say, in sentences."""
        told = []
        by = "over time" if self.timed else "in the order of the table"
        if self.over_time.known:
            meaning = " (creep, drift of the light or of the scale)"
            told.append(
                f"Residual force {by}: {self.over_time.change:+.1%} ± {self.over_time.sigma:.1%} "
                "from the first press to the last"
                f"{meaning if self.over_time.clear else ', no clear trend'}."
            )
        if self.unloading.known:
            meaning = " (hysteresis)" if self.unloading.clear else ", no clear hysteresis"
            told.append(
                "Residual force after a larger load less that after a smaller one: "
                f"{self.unloading.change:+.1%} ± {self.unloading.sigma:.1%}{meaning}."
            )
        if self.modulus_sigma:
            told.append(
                f"Young's modulus is the mean over this: its standard deviation contains "
                f"{self.modulus_sigma:.1%} for it."
            )
        return tuple(told)


def press_trends(presses: Sequence[FittedPress], sigma: Array) -> PressTrends:
    """Trends of the presses.

    Args:
        presses: n presses in the order of the table.
        sigma: (n,) relative standard deviation of each residual as stated. Where the residuals
            scatter more about a trend, the scatter counts.
    """
    residual = np.array([press.residual for press in presses])
    times = [press.load.time_s for press in presses]
    timed = all(time is not None for time in times)
    at = np.array(times if timed else np.arange(len(presses)), dtype=float)
    order = np.argsort(at, kind="stable")
    force = np.array([press.force_n for press in presses])[order]
    falling = np.diff(force) < 0
    later = order[1:]
    return PressTrends(
        _slope(at, residual, sigma), timed, _difference(residual[later], sigma[later], falling)
    )


def _slope(at: Array, residual: Array, sigma: Array) -> Trend:
    span = float(np.ptp(at))
    return _fitted(at / span, residual, sigma) if span > 0 else Trend()


def _difference(residual: Array, sigma: Array, chosen: NDArray[np.bool_]) -> Trend:
    both = chosen.any() and not chosen.all()
    return _fitted(chosen.astype(float), residual, sigma) if both else Trend()


def _fitted(unit: Array, residual: Array, sigma: Array) -> Trend:
    """Weighted least squares of a mean and of a change per unit (n,)."""
    freedom = len(residual) - 2
    if len(residual) < _LEAST_PRESSES:
        return Trend()
    weight = sigma**-2.0
    unit = unit - weight @ unit / weight.sum()
    own = float(weight @ unit**2)
    change = float(weight @ (unit * residual)) / own
    left = residual - weight @ residual / weight.sum() - change * unit
    scatter = max(1.0, float(weight @ left**2) / freedom)
    return Trend(change, float(np.sqrt(scatter / own)), freedom)
