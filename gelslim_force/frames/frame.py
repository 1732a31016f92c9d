"""A frame of a source, and the interface of all sources."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import GelslimError

Picture = NDArray[np.uint8]
"""(h, w) grey or (h, w, 3) in the order red, green, blue; contiguous."""


class FrameSourceError(GelslimError, ValueError):
    """No frame can be read from a source."""


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame of a source.

    Attributes:
        index: Number in the source, from 0. A live source that is faster than its reader leaves
            gaps.
        time_s: Time since the first frame; the index if the source has no rate.
        image: The picture, or None if it could not be read.
        problem: Why it could not be read.
        name: Name of the file, for a source of several files.
    """

    index: int
    time_s: float
    image: Picture | None
    problem: str = ""
    name: str = ""


class FrameSource(AbstractContextManager[Any]):
    """Frames in order; `close`, or the end of a `with` block, frees files and cameras.

    Attributes:
        count: Number of frames; None if it is not known.
        frames_per_s: Rate; None if it is not known.
        live: Whether frames arrive in real time, so that old ones may be dropped.
    """

    count: int | None = None
    frames_per_s: float | None = None
    live: bool = False

    @abstractmethod
    def __iter__(self) -> Iterator[Frame]:
        """Yield every frame, also those that cannot be read."""

    def close(self) -> None:
        """Free files and cameras; a second call does nothing."""

    def __enter__(self) -> Self:
        """Return the source."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the source."""
        self.close()


def size_problem(image: Picture, shape: tuple[int, ...]) -> str:
    """Return how a picture differs from the `shape` of the others; empty if it does not."""
    if image.shape == shape:
        return ""
    if image.shape[:2] == shape[:2]:
        kinds = {2: "grey", 3: "in colour"}
        return f"the picture is {kinds[image.ndim]}, the others are {kinds[len(shape)]}"
    return (
        f"the picture is {image.shape[1]} x {image.shape[0]} px, "
        f"the others are {shape[1]} x {shape[0]} px"
    )
