"""Overlay pictures and video of a run, drawn in one scale once the run is known.

Drawing takes longer than estimating; frames to draw are kept as they came and drawn at the end,
or one by one where the run has no end.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.arrow_scale import ArrowScale, LiveScale, extent, scale_for
from gelslim_force.outputs.overlay import Overlay, write_overlay
from gelslim_force.outputs.overlay_video import OverlayVideo

_PICTURE = re.compile(r"frame_\d{6,}\.png")
Show = Callable[[NDArray[np.uint8], FrameResult], None]


@dataclass(eq=False)
class PictureSink:
    """Keeps up to `most` frames spread over the run, and writes them to a folder at the end."""

    overlay: Overlay
    folder: str | os.PathLike[str]
    most: int
    _kept: list[tuple[NDArray[np.uint8] | None, FrameResult]] = field(default_factory=list)
    _every: int = 1
    _count: int = 0

    def take(self, image: NDArray[np.uint8] | None, result: FrameResult) -> None:
        """Keep the frame if its turn has come; every other one is dropped when there are twice
        as many as wanted."""
        if self._count % self._every == 0:
            self._kept.append((image, result))
            if len(self._kept) > 2 * self.most:
                self._kept, self._every = self._kept[::2], 2 * self._every
        self._count += 1

    def write(self) -> list[Path]:
        """Draw and write what was kept; returns the files."""
        chosen = self._kept
        if len(chosen) > self.most:
            places = np.linspace(0, len(chosen) - 1, self.most).round().astype(int)
            chosen = [chosen[i] for i in places]
        scale = _common_scale([r for _, r in chosen])
        files = []
        for image, result in chosen:
            path = Path(self.folder) / f"frame_{result.index:06d}.png"
            path.parent.mkdir(parents=True, exist_ok=True)
            write_overlay(path, self.overlay.draw(image, result, scale))
            files.append(path)
        for old in Path(self.folder).glob("frame_*.png"):
            if old not in files and _PICTURE.fullmatch(old.name):
                old.unlink()  # of an earlier, other run
        return files


@dataclass(eq=False)
class VideoSink:
    """Draws every frame into a video as it comes."""

    overlay: Overlay
    video: OverlayVideo
    scale: LiveScale

    def take(self, image: NDArray[np.uint8] | None, result: FrameResult) -> None:
        """Draw and append."""
        self.video.append(self.overlay.draw(image, result, self.scale.scale(result)))


@dataclass(eq=False)
class ViewSink:
    """Shows every n-th frame, such as in a `LiveView`."""

    overlay: Overlay
    show: Show
    scale: LiveScale
    every: int = 3
    _count: int = 0

    def take(self, image: NDArray[np.uint8] | None, result: FrameResult) -> None:
        """Draw and show, if its turn has come."""
        if self._count % self.every == 0:
            self.show(self.overlay.draw(image, result, self.scale.scale(result)), result)
        self._count += 1


def _common_scale(results: list[FrameResult]) -> ArrowScale:
    sizes = [extent(r) for r in results]
    largest = sizes[0] if sizes else None
    for size in sizes[1:]:
        assert largest is not None
        largest = largest.joined(size)
    if largest is None:
        raise ValueError("no frame to draw")
    return scale_for(largest)
