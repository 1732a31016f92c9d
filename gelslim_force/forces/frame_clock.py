"""Stage times of one frame."""

from __future__ import annotations

import time


class FrameClock:
    """Time per stage of one frame, ms."""

    def __init__(self) -> None:
        self.stages: dict[str, float] = {}
        self._last = time.perf_counter()

    def stage(self, name: str) -> None:
        """Close a stage."""
        now = time.perf_counter()
        self.stages[name] = self.stages.get(name, 0.0) + (now - self._last) * 1000
        self._last = now
