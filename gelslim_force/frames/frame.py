"""A frame of a source, and the interface of all sources."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from numbers import Real
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import GelslimError

Picture = NDArray[np.uint8]
"""(h, w) grey or (h, w, 3) in the order red, green, blue; contiguous."""


_LATEST_STAMP_S = 1e11
"""Stamps beyond, some 3000 years from now, are taken for milliseconds or nanoseconds."""


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
        stamp_s: When it was taken, in seconds since the start of 1970 (UTC); None if the source
            does not know. It serves to merge frames with other logs; differences are better taken
            of `time_s`, because a system clock may be set in between.
        sensor_s: Time by the clock of the camera or its driver, whose zero is its own; None if the
            source has none.
    """

    index: int
    time_s: float
    image: Picture | None
    problem: str = ""
    name: str = ""
    stamp_s: float | None = None
    sensor_s: float | None = None


@dataclass(frozen=True)
class FrameTimes:
    """When a picture was taken; None where it is not known.

    Attributes:
        time_s: Time since the first frame, or by a clock of the caller.
        stamp_s: Seconds since the start of 1970 (UTC).
        sensor_s: Time by the clock of the camera or its driver.

    Raises:
        ValueError: A time is no finite number, or `stamp_s` is negative or in another unit than
            seconds.
    """

    time_s: float | None = None
    stamp_s: float | None = None
    sensor_s: float | None = None

    def __post_init__(self) -> None:
        problem = "" if self.stamp_s is None else stamp_problem(self.stamp_s)
        if problem:
            raise ValueError(problem)
        if self.time_s is not None and not _is_finite(self.time_s):
            raise ValueError(f"time_s = {self.time_s!r}: must be a finite number of seconds")

    @classmethod
    def of(cls, frame: object, time_s: float | None, stamp_s: float | None) -> FrameTimes:
        """Times that the caller gives, and otherwise those of the frame; a picture has none."""
        if not isinstance(frame, Frame):
            return cls(time_s, stamp_s)
        return cls(
            frame.time_s if time_s is None else time_s,
            frame.stamp_s if stamp_s is None else stamp_s,
            frame.sensor_s,
        )


def stamp_problem(stamp_s: float) -> str:
    """Return why a number cannot be seconds since 1970; empty if it can."""
    limits = f"must be seconds since 1970 in 0 ... {_LATEST_STAMP_S:g}"
    if not isinstance(stamp_s, Real):
        return f"stamp_s = {stamp_s!r}: {limits}, as time.time() and datetime.timestamp() give them"
    if _is_finite(stamp_s) and 0 <= stamp_s <= _LATEST_STAMP_S:
        return ""
    return f"stamp_s = {float(stamp_s):g}: {limits}; divide nanoseconds by 1e9"


def _is_finite(value: object) -> bool:
    return isinstance(value, Real) and math.isfinite(value)


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
