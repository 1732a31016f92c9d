"""How long each stage of a frame takes: measured in one frame, summarised over a run.

The summary needs fixed memory for a run of any length. Medians and percentiles are of the last
`window` frames; count, mean and largest value are of the whole run.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

TOTAL = "total"
"""Name of the sum of a frame's stages."""


class FrameClock:
    """Measures the stages of one frame in ms, one after the other."""

    def __init__(self) -> None:
        self.stages: dict[str, float] = {}
        self._last = time.perf_counter()

    def stage(self, name: str) -> None:
        """End a stage, which began at the end of the stage before."""
        now = time.perf_counter()
        self.stages[name] = self.stages.get(name, 0.0) + (now - self._last) * 1000
        self._last = now


@dataclass(frozen=True)
class StageTimes:
    """One stage over a run, in ms."""

    stage: str
    frames: int
    """Frames in which the stage ran."""
    mean_ms: float
    largest_ms: float
    median_ms: float
    p95_ms: float
    p99_ms: float
    """Median and percentiles are of the last frames that are kept."""


class _Ring:
    """The last values of one stage, and sums over all of them."""

    def __init__(self, window: int) -> None:
        self._last: NDArray[np.float64] = np.zeros(window)
        self.count, self._sum, self._largest = 0, 0.0, 0.0

    def add(self, value: float) -> None:
        self._last[self.count % len(self._last)] = value
        self.count += 1
        self._sum += value
        self._largest = max(self._largest, value)

    def times(self, stage: str) -> StageTimes:
        last = self._last[: min(self.count, len(self._last))]
        median, p95, p99 = (float(v) for v in np.percentile(last, [50, 95, 99]))
        return StageTimes(
            stage, self.count, self._sum / self.count, self._largest, median, p95, p99
        )


class StageSummary:
    """Collects the stage times of the frames of a run. Raises ValueError for a window below 1."""

    def __init__(self, window: int = 4096) -> None:
        if window < 1:
            raise ValueError(f"window = {window}: must be >= 1")
        self._window = window
        self._rings: dict[str, _Ring] = {}

    def add(self, stage_ms: Mapping[str, float]) -> None:
        """Add the stages of one frame, in ms by name."""
        if not stage_ms:
            return
        for name, value in (*stage_ms.items(), (TOTAL, sum(stage_ms.values()))):
            self._rings.setdefault(name, _Ring(self._window)).add(value)

    def times(self) -> tuple[StageTimes, ...]:
        """Return the stages in the order in which they first ran, and their sum at the end."""
        names = [name for name in self._rings if name != TOTAL]
        if names:
            names.append(TOTAL)
        return tuple(self._rings[name].times(name) for name in names)
