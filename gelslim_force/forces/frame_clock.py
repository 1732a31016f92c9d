"""Time of the stages of one frame."""

from __future__ import annotations

import time


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
