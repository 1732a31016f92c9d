"""How long each stage of a frame takes, over a run of any length in fixed memory.

Medians and percentiles are of the last `window` frames; count, mean and largest of the whole run.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

TOTAL = "total"
"""Name of the sum of a frame's stages."""


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
    """The three percentiles are of the last frames that the clock remembers."""


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


class StageClock:
    """Times the stages of one frame after another.

    >>> clock = StageClock()
    >>> with clock.stage("detect"):
    ...     pass
    >>> list(clock.frame_done())
    ['detect']
    """

    def __init__(
        self,
        window: int = 4096,
        warm_up: int = 0,
        now_s: Callable[[], float] = time.perf_counter,
    ) -> None:
        """`warm_up` first frames are timed, but do not count in the summary.

        Raises ValueError for a window under 1 or a negative warm-up.
        """
        if window < 1 or warm_up < 0:
            raise ValueError(f"window = {window}, warm_up = {warm_up}: need >= 1 and >= 0")
        self._window, self._skip, self._now_s = window, warm_up, now_s
        self._frame: dict[str, float] = {}
        self._rings: dict[str, _Ring] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a block; a stage entered twice in one frame adds up. Raises ValueError for TOTAL."""
        if name == TOTAL:
            raise ValueError(f"{TOTAL!r} is the sum of all stages; choose another name")
        start = self._now_s()
        try:
            yield
        finally:
            self._frame[name] = self._frame.get(name, 0.0) + 1e3 * (self._now_s() - start)

    def frame_done(self) -> dict[str, float]:
        """Return the frame's ms by stage, in the order they ran, and begin the next frame."""
        frame, self._frame = self._frame, {}
        if self._skip:
            self._skip -= 1
        else:
            self.add(frame)
        return frame

    def add(self, stage_ms: Mapping[str, float]) -> None:
        """Count a frame timed elsewhere, such as one read from a recording."""
        if not stage_ms:
            return
        for name, value in (*stage_ms.items(), (TOTAL, sum(stage_ms.values()))):
            self._rings.setdefault(name, _Ring(self._window)).add(value)

    def summary(self) -> tuple[StageTimes, ...]:
        """Return the stages in the order they first ran, and their sum at the end."""
        names = [name for name in self._rings if name != TOTAL]
        if names:
            names.append(TOTAL)
        return tuple(self._rings[name].times(name) for name in names)
