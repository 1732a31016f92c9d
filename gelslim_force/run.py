"""Frames of a source through the force pipeline into outputs."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.forces.gel_law import GelUse
from gelslim_force.frames.frame import Frame
from gelslim_force.frames.upright import upright
from gelslim_force.pipeline import ForcePipeline

Progress = Callable[[str, int, int], None]
TOTAL = "total"
"""Name of the sum of a frame's stages."""
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")
_TIMED_FRAMES = 4096
"""Frames at the end of a run over which the median times are taken: memory does not grow."""


class Sink(Protocol):
    """An output that takes results one by one."""

    def take(self, image: NDArray[np.uint8] | None, result: FrameResult) -> None:
        """Take the result of one frame, and its picture if it has one."""


@dataclass
class RunSummary:
    """Counts and extreme values of a run."""

    frames: int = 0
    dropped: int = 0
    """Frames of a camera that were dropped for newer ones, as the reader of the frames counts."""
    with_forces: int = 0
    problems: dict[str, int] = field(default_factory=dict)
    """Number of frames with each problem; of those that differ in numbers only, the first stands
    for all."""
    first_of_kind: dict[str, str] = field(default_factory=dict)
    """Those first problems by their words without numbers."""
    least_coverage: float = 1.0
    largest_force_n: float = 0.0
    gel: GelUse = field(default_factory=GelUse)
    """Frames with forces by the law of the gel."""
    last: FrameResult | None = None
    stage_ms: dict[str, deque[float]] = field(default_factory=dict)
    """Times of the last frames by stage."""

    def add(self, result: FrameResult) -> None:
        """Add a frame."""
        self.frames += 1
        self.last = result
        for name, value in result.stage_ms.items():
            self._times(name).append(value)
        if result.stage_ms:
            self._times(TOTAL).append(sum(result.stage_ms.values()))
        for problem in result.problems:
            kind = _NUMBER.sub("", problem)
            first = self.first_of_kind.setdefault(kind, problem)
            self.problems[first] = self.problems.get(first, 0) + 1
        if result.tracks is not None:
            self.least_coverage = min(self.least_coverage, result.coverage)
        if result.wrench is not None:
            self.with_forces += 1
            if "gel" in result.extra:
                self.gel.add(result.extra["gel"])
            size = float(np.sqrt(np.nansum(result.wrench.force_n**2)))
            self.largest_force_n = max(self.largest_force_n, size)

    def median_ms(self) -> dict[str, float]:
        """Median time by stage, in the order in which they first ran, and of their sum, `total`."""
        names = sorted(self.stage_ms, key=lambda name: name == TOTAL)
        return {name: float(np.median(self.stage_ms[name])) for name in names}

    def _times(self, stage: str) -> deque[float]:
        return self.stage_ms.setdefault(stage, deque(maxlen=_TIMED_FRAMES))


def run_frames(
    pipeline: ForcePipeline,
    frames: Iterable[Frame],
    sinks: Sequence[Sink],
    count: int | None = None,
    progress: Progress | None = None,
) -> RunSummary:
    """Process every frame and pass the results to all sinks.

    A frame that cannot be read gives a result with a problem. If a frame or a sink raises an
    error, the sinks keep what they took before.

    Args:
        pipeline: The pipeline of the sensor.
        frames: Frames in order, such as those of `open_frames`.
        sinks: Outputs that take each result.
        count: Number of frames, for `progress`; None if it is not known.
        progress: Called after each frame with the text "frames", the number of processed frames
            and their total.

    Returns:
        Counts and extreme values of the run.

    Raises:
        OutputError: A sink cannot write.
        FrameSourceError: The source fails.
    """
    report = progress or (lambda text, done, total: None)
    summary = RunSummary()
    for frame in frames:
        image = frame.image
        if image is not None:
            image = upright(image, pipeline.calibration.camera)
        result = pipeline.process(replace(frame, image=image))
        summary.add(result)
        for sink in sinks:
            sink.take(image, result)
        report("frames", summary.frames, count or summary.frames + 1)
    return summary
