"""Where the results of a run go: recorders, overlay pictures, a video, a live view.

Pictures of a run are drawn at its end, because drawing takes longer than estimating and because
all of them share one scale. A video and a live view are drawn frame by frame.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.arrow_scale import LiveScale, scale_of_run
from gelslim_force.outputs.overlay import Overlay, write_overlay
from gelslim_force.outputs.overlay_video import OverlayVideo
from gelslim_force.tracking.drift_filter import TareError

_PICTURE = re.compile(r"frame_\d{6,}\.png")
Show = Callable[[NDArray[np.uint8], FrameResult], None]


class Recorder(Protocol):
    """A run folder or a recording."""

    def append(self, result: FrameResult) -> None:
        """Keep a result."""


@dataclass(frozen=True, eq=False)
class RecorderSink:
    """Passes results on to a recorder, without their pictures.

    Attributes:
        recorder: A `RunRecorder` or a `McapRecording`.
    """

    recorder: Recorder

    def take(self, image: NDArray[np.uint8] | None, result: FrameResult) -> None:
        """Record the result."""
        self.recorder.append(result)


@dataclass(eq=False)
class PictureSink:
    """Keeps frames that are spread evenly over the run; `write` draws them at its end.

    Attributes:
        overlay: What draws the pictures.
        folder: Where the pictures go.
        most: Largest number of pictures.
    """

    overlay: Overlay
    folder: str | os.PathLike[str]
    most: int
    _kept: list[tuple[NDArray[np.uint8] | None, FrameResult]] = field(default_factory=list)
    _every: int = 1
    _count: int = 0

    def take(self, image: NDArray[np.uint8] | None, result: FrameResult) -> None:
        """Keep every n-th frame; n doubles when there are twice as many frames as wanted."""
        if self._count % self._every == 0:
            self._kept.append((image, result))
            if len(self._kept) > 2 * self.most:
                self._kept, self._every = self._kept[::2], 2 * self._every
        self._count += 1

    def write(self) -> list[Path]:
        """Draw and write the frames that were kept.

        Returns the files. Raises OutputError, and ValueError if the run had no frame.
        """
        chosen = self._kept
        if len(chosen) > self.most:
            places = np.linspace(0, len(chosen) - 1, self.most).round().astype(int)
            chosen = [chosen[i] for i in places]
        if not chosen:
            raise ValueError("the run has no frame to draw")
        scale = scale_of_run(result for _, result in chosen)
        files = []
        for image, result in chosen:
            path = Path(self.folder) / f"frame_{result.index:06d}.png"
            path.parent.mkdir(parents=True, exist_ok=True)
            write_overlay(path, self.overlay.draw(image, result, scale))
            files.append(path)
        for old in Path(self.folder).glob("frame_*.png"):
            if old not in files and _PICTURE.fullmatch(old.name):
                old.unlink()  # left by an earlier run into this folder
        return files


@dataclass(eq=False)
class VideoSink:
    """Draws every frame into a video."""

    overlay: Overlay
    video: OverlayVideo
    scale: LiveScale

    def take(self, image: NDArray[np.uint8] | None, result: FrameResult) -> None:
        """Draw the frame and append it to the video."""
        self.video.append(self.overlay.draw(image, result, self.scale.scale(result)))


@dataclass(eq=False)
class ViewSink:
    """Shows every n-th frame, for example in a `LiveView`.

    Attributes:
        overlay: What draws the pictures.
        show: Shows a picture with its result.
        scale: Lengths of the arrows.
        every: n.
        note: Takes every result, also of frames that are not shown.
    """

    overlay: Overlay
    show: Show
    scale: LiveScale
    every: int = 3
    note: Callable[[FrameResult], None] | None = None
    _count: int = 0

    def take(self, image: NDArray[np.uint8] | None, result: FrameResult) -> None:
        """Draw and show the frame if it is an n-th one."""
        if self.note is not None:
            self.note(result)
        if self._count % self.every == 0:
            self.show(self.overlay.draw(image, result, self.scale.scale(result)), result)
        self._count += 1


@dataclass(frozen=True, eq=False)
class TareSink:
    """Takes a new rest where a viewer has asked for one.

    Attributes:
        tare: Takes the rest from a picture and its time in s, and returns a sentence about it.
        grant: Calls what it is given if a rest was asked for, such as `LiveView.grant`.
    """

    tare: Callable[[NDArray[np.uint8], float], str]
    grant: Callable[[Callable[[], str]], None]

    def take(self, image: NDArray[np.uint8] | None, result: FrameResult) -> None:
        """Take the rest from this frame's picture."""

        def taken() -> str:
            if image is None:
                raise TareError("this frame could not be read; try again")
            return self.tare(image, result.time_s)

        self.grant(taken)
