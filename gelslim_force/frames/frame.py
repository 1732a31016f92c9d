"""One frame of a source, or the reason why there is none; and what every source offers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from gelslim_core.extras import install_command
from ifem_export.errors import IfemError

Picture = NDArray[np.uint8]
"""(h, w) grey or (h, w, 3) red, green, blue; contiguous."""


class FrameSourceError(IfemError):
    """Nothing can be read from what was named as a source; the message says why."""


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame as it comes from a source."""

    index: int
    """Number in the source, from 0; a gap is where a live source was too fast."""
    time_s: float
    """From the first frame on; the number of the frame where the source knows no rate."""
    image: Picture | None
    """None where the frame could not be read."""
    problem: str = ""
    """Why it could not be read."""
    name: str = ""
    """File, for a source of several."""


class FrameSource(Protocol):
    """Frames in order. Leaving its `with` block, or `close`, frees files and cameras."""

    @property
    def count(self) -> int | None:
        """Frames expected; None where that is not known."""

    @property
    def frames_per_s(self) -> float | None:
        """Rate; None where that is not known."""

    @property
    def live(self) -> bool:
        """Whether frames come at their own pace, and stale ones are worth nothing."""

    def __iter__(self) -> Iterator[Frame]:
        """Yield every frame, unreadable ones too."""

    def close(self) -> None:
        """Free what is held; a second call does nothing."""


class SourceContext:
    """A source's `with` block."""

    def close(self) -> None:
        """Free what is held."""

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        """Close."""
        self.close()


def size_problem(image: Picture, shape: tuple[int, ...]) -> str:
    """Return why a picture is no frame of a source of pictures of `shape`; empty if it is one."""
    if image.shape == shape:
        return ""
    if image.shape[:2] == shape[:2]:
        kinds = {2: "grey", 3: "in colour"}
        return f"the picture is {kinds[image.ndim]}, the others are {kinds[len(shape)]}"
    return (
        f"the picture is {image.shape[1]} x {image.shape[0]} px, "
        f"the others are {shape[1]} x {shape[0]} px"
    )


def with_vision(purpose: str, error: ImportError) -> FrameSourceError:
    """Return the error for an optional library that is missing."""
    return FrameSourceError(
        f"{purpose} needs the Python package {(error.name or 'opencv')!r} ({error}); "
        f"install it with: {install_command('vision')}"
    )
