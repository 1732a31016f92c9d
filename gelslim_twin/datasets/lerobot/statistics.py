"""Statistics of columns, by which LeRobot normalises what a policy takes.

Those of an episode are exact. Minimum, maximum, mean and deviation of the data set follow from them
exactly; its quantiles are the means of those of the episodes, weighted with their frames, as
LeRobot itself combines them. Values that do not exist are left out.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
_LEVELS = np.arange(256) / 255


def of_values(values: NDArray[Any]) -> dict[str, Array]:
    """Statistics of values (t,) or (t, ..., k), each (1,) or (k,).

    All axes but the last are taken together, as LeRobot does with fields.
    """
    rows = values.reshape(-1, values.shape[-1] if values.ndim > 1 else 1).astype(np.float64)
    with warnings.catch_warnings():
        # A column without any value has no statistics.
        warnings.simplefilter("ignore", RuntimeWarning)
        found = {
            "min": np.nanmin(rows, axis=0),
            "max": np.nanmax(rows, axis=0),
            "mean": np.nanmean(rows, axis=0),
            "std": np.nanstd(rows, axis=0),
            **dict(zip(QUANTILES, _quantiles(rows), strict=True)),
        }
    return {**found, "count": np.array([float(len(values))])}


def _quantiles(rows: Array) -> Array:
    """The quantiles (5, k) of rows (n, k), values that do not exist left out.

    NumPy takes whole columns together and those with gaps one by one, a thousand times slower.
    """
    shares = list(QUANTILES.values())
    whole = ~np.isnan(rows).any(axis=0)
    found = np.empty((len(shares), rows.shape[1]))
    found[:, whole] = np.quantile(rows[:, whole], shares, axis=0)
    if not whole.all():
        found[:, ~whole] = np.nanquantile(rows[:, ~whole], shares, axis=0)
    return found


def of_pictures(pictures: Iterable[NDArray[np.uint8]]) -> dict[str, Array]:
    """Statistics (3, 1, 1) of all pixels of pictures (h, w, 3), as shares of white.

    They are those of the histogram of each channel, so they take the memory of one picture.
    """
    histogram, count = np.zeros((3, 256)), 0
    for picture in pictures:
        count += 1
        for channel in range(3):
            histogram[channel] += np.bincount(picture[..., channel].ravel(), minlength=256)
    share = histogram / histogram.sum(axis=1, keepdims=True)
    mean = share @ _LEVELS
    seen = histogram > 0
    below = np.cumsum(share, axis=1)
    found = {
        "min": _LEVELS[seen.argmax(axis=1)],
        "max": _LEVELS[255 - seen[:, ::-1].argmax(axis=1)],
        "mean": mean,
        "std": np.sqrt(np.sum(share * (_LEVELS - mean[:, None]) ** 2, axis=1)),
        **{
            name: _LEVELS[np.argmax(below >= level - 1e-12, axis=1)]
            for name, level in QUANTILES.items()
        },
    }
    return {**{name: v.reshape(3, 1, 1) for name, v in found.items()}, "count": np.array([count])}


class Combination:
    """Statistics of many episodes, taken a few at a time; components that none has are NaN."""

    def __init__(self) -> None:
        """Begin without an episode."""
        self._count: Array = np.zeros(1)
        self._extremes: dict[str, Array] = {}
        self._weight: Array = np.zeros(1)
        self._sums: dict[str, Array] = {}
        self._spread: Array = np.zeros(1)

    def add(self, episodes: Mapping[str, Array]) -> None:
        """Take the statistics (n, k) of n episodes by name, and their `count` (n, 1)."""
        count, mean = episodes["count"], episodes["mean"]
        weight = np.where(np.isfinite(mean), count, 0.0)
        sums = {
            name: np.sum(weight * np.nan_to_num(episodes[name]), axis=0)
            for name in ("mean", *QUANTILES)
        }
        total = weight.sum(axis=0)
        middle = sums["mean"] / np.where(total > 0, total, 1.0)
        apart = np.nan_to_num(episodes["std"]) ** 2 + (np.nan_to_num(mean) - middle) ** 2
        spread = np.sum(weight * apart, axis=0)
        if self._sums:
            # Both parts spread about their own means (Chan, Golub and LeVeque 1983).
            whole, other = total + self._weight, np.where(self._weight > 0, self._weight, 1.0)
            gap = middle - self._sums["mean"] / other
            share = total * self._weight / np.where(whole > 0, whole, 1.0)
            spread = spread + self._spread + share * gap**2
            total = whole
            sums = {name: values + self._sums[name] for name, values in sums.items()}
        self._count = self._count + count.sum(axis=0)
        self._weight, self._sums, self._spread = total, sums, spread
        for name, extreme in (("min", np.fmin), ("max", np.fmax)):
            found: Array = extreme.reduce(episodes[name])
            before = self._extremes.get(name)
            self._extremes[name] = found if before is None else extreme(before, found)

    def result(self) -> dict[str, Array]:
        """The statistics (k,) of all episodes together."""
        some = np.where(self._weight > 0, self._weight, np.nan)
        return {
            **self._extremes,
            "std": np.sqrt(self._spread / some),
            **{name: values / some for name, values in self._sums.items()},
            "count": self._count,
        }
