"""A stream of frames through the pipeline into its outputs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.forces.stage_clock import StageSummary, StageTimes
from gelslim_force.pipeline import ForcePipeline

Progress = Callable[[str, int, int], None]


class Frame(Protocol):
    """One frame of a source."""

    @property
    def index(self) -> int:
        """Number in the source."""

    @property
    def time_s(self) -> float:
        """When it was taken."""

    @property
    def image(self) -> NDArray[np.uint8] | None:
        """Picture, RGB or grey; None where it could not be read."""

    @property
    def problem(self) -> str:
        """Why it could not be read."""


class Sink(Protocol):
    """Something that takes results as they come."""

    def take(self, image: NDArray[np.uint8] | None, result: FrameResult) -> None:
        """One frame with its picture."""


@dataclass
class RunSummary:
    """What a run came to."""

    frames: int = 0
    with_forces: int = 0
    problems: dict[str, int] = field(default_factory=dict)
    """How often each problem was met, numbers apart."""
    least_coverage: float = 1.0
    largest_force_n: float = 0.0
    last: FrameResult | None = None
    stages: tuple[StageTimes, ...] = ()

    def add(self, result: FrameResult) -> None:
        """Count a frame."""
        self.frames += 1
        self.last = result
        for problem in result.problems:
            kind = "".join("#" if c.isdigit() else c for c in problem)
            self.problems[kind] = self.problems.get(kind, 0) + 1
        if result.tracks is not None:
            self.least_coverage = min(self.least_coverage, result.coverage)
        if result.wrench is not None:
            self.with_forces += 1
            size = float(np.sqrt(np.nansum(result.wrench.force_n**2)))
            self.largest_force_n = max(self.largest_force_n, size)


def run_frames(
    pipeline: ForcePipeline,
    frames: Iterable[Frame],
    sinks: Sequence[Sink],
    count: int | None = None,
    progress: Progress | None = None,
) -> RunSummary:
    """Process every frame; a frame that cannot be read is recorded as such.

    `count` frames are expected, None where that is not known. What was taken by the sinks stays
    when a later frame or sink raises.
    """
    tell = progress or (lambda text, done, total: None)
    clock = StageSummary()
    summary = RunSummary()
    for frame in frames:
        if frame.image is None:
            result = pipeline.unreadable(frame.problem, time_s=frame.time_s)
        else:
            result = pipeline.process(frame.image, time_s=frame.time_s)
        clock.add(result.stage_ms)
        summary.add(result)
        for sink in sinks:
            sink.take(frame.image, result)
        tell("frames", summary.frames, count or summary.frames + 1)
    summary.stages = clock.times()
    return summary
