"""Dots drawn by n x n samples per pixel, the alternative to exact areas that a bench measures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gelslim_twin.render.frame_renderer import FrameRenderer


@njit(cache=True, nogil=True)
def add_samples(ink: Any, polygon: Any, n: Any) -> None:
    """Add to `ink` (h, w) the share of n x n samples per pixel inside `polygon` (k, 2)."""
    left, right = polygon[:, 0].min(), polygon[:, 0].max()
    top, bottom = polygon[:, 1].min(), polygon[:, 1].max()
    for row in range(max(0, int(top)), min(ink.shape[0], int(bottom) + 2)):
        for column in range(max(0, int(left)), min(ink.shape[1], int(right) + 2)):
            count = 0
            for i in range(n):
                y = row - 0.5 + (i + 0.5) / n
                for j in range(n):
                    x = column - 0.5 + (j + 0.5) / n
                    inside = False
                    for k in range(len(polygon)):
                        xa, ya = polygon[k - 1]
                        xb, yb = polygon[k]
                        if (ya > y) != (yb > y) and xa + (y - ya) / (yb - ya) * (xb - xa) > x:
                            inside = not inside
                    count += inside
            ink[row, column] = min(ink[row, column] + count / n**2, 1.0)


@dataclass(frozen=True, eq=False)
class SampledRenderer(FrameRenderer):
    """A renderer of sharp dots at rest or pressed, whose coverage is sampled."""

    samples: int = 1

    def _ink(self, start: Any, now: Any, drawn: Any, *_: Any) -> NDArray[np.float32]:
        ink = np.zeros((self.camera.image_height_px, self.camera.image_width_px), np.float32)
        for outline in now[drawn]:
            add_samples(ink, outline, self.samples)
        return ink
