"""Results into whatever has an `append`, such as a run folder or a recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.frame_result import FrameResult


class Recorder(Protocol):
    """What keeps results."""

    def append(self, result: FrameResult) -> None:
        """Keep one."""


@dataclass(frozen=True, eq=False)
class RecorderSink:
    """Takes frames with their pictures and keeps the results alone."""

    recorder: Recorder

    def take(self, image: NDArray[np.uint8] | None, result: FrameResult) -> None:
        """Keep the result."""
        self.recorder.append(result)
