"""Dots that move while the shutter is open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MotionBlur:
    """Motion blur by a shutter that is open for the last `open_share` of the time step.

    Dots move uniformly on straight lines. The blur is the mean of at most `most_poses` poses, no
    farther apart than `px_per_pose`. Raises ValueError for values out of range.
    """

    open_share: float = 1.0
    px_per_pose: float = 0.5
    most_poses: int = 16

    def __post_init__(self) -> None:
        if not 0 <= self.open_share <= 1:
            raise ValueError(f"open_share = {self.open_share}: must be in 0 ... 1")
        if not self.px_per_pose > 0 or self.most_poses < 1:
            raise ValueError("px_per_pose must be positive and most_poses at least 1")

    def start(self, before: Array, now: Array) -> Array:
        """Outlines (m, k, 2) when the shutter opens."""
        if self.open_share == 0:
            return now
        opened: Array = now + self.open_share * (before - now)
        return opened

    def poses(self, start: Array, now: Array) -> NDArray[np.int64]:
        """How many poses (m,) to draw of each dot; 1 for a dot that stands still."""
        from gelslim_twin.render.dot_kernel import farthest

        path = np.empty(len(now))
        farthest(start, now, path)
        wanted = np.ceil(path / self.px_per_pose)
        return np.clip(wanted, 1, self.most_poses).astype(np.int64)
