"""NumPy arrays as frames: in memory, from `.npy` files (mapped into memory) and `.npz` files."""

from __future__ import annotations

import os
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_force.frames.frame import Frame, FrameSource, FrameSourceError, stamp_problem
from gelslim_force.frames.picture import as_picture

_KEYS = ("frames", "images", "image", "frame")
_TIMES = ("time_s", "times_s")
_STAMPS = ("stamp_s", "stamps_s")


class FrameArray(FrameSource):
    """Frames of an array (n, h, w[, 1 | 3 | 4]) or of one picture (h, w[, 3 | 4]), uint8."""

    def __init__(
        self,
        frames: NDArray[np.uint8],
        time_s: ArrayLike | None = None,
        frames_per_s: float | None = None,
        name: str = "array",
        stamp_s: ArrayLike | None = None,
    ) -> None:
        """Take the frames and, if known, the time (n,) at which each was taken.

        `stamp_s` (n,) are seconds since 1970 (UTC). Raises FrameSourceError for another kind of
        array, and for times that do not fit it.
        """
        single = frames.ndim == 2 or (frames.ndim == 3 and frames.shape[2] <= 4)
        stack = frames[None] if single else frames
        right = stack.ndim == 3 or (stack.ndim == 4 and stack.shape[3] in (1, 3, 4))
        if stack.dtype != np.uint8 or not right or 0 in stack.shape:
            raise FrameSourceError(
                f"{name}: an array of {frames.dtype} {frames.shape} holds no frames; give uint8 "
                "(n, h, w) or (n, h, w, 3), levels 0 ... 255"
            )
        self._frames = stack
        self.count, self.frames_per_s = len(stack), frames_per_s
        self._times = _checked(time_s, "times", len(stack), name)
        self._stamps = _checked(stamp_s, "stamps", len(stack), name)
        for stamp in () if self._stamps is None else (self._stamps.min(), self._stamps.max()):
            if problem := stamp_problem(stamp):
                raise FrameSourceError(f"{name}: {problem}")

    def __iter__(self) -> Iterator[Frame]:
        """Yield each frame, copied."""
        for index in range(len(self._frames)):
            time_s = index / (self.frames_per_s or 1.0)
            if self._times is not None:
                time_s = float(self._times[index])
            stamp_s = None if self._stamps is None else float(self._stamps[index])
            image = as_picture(np.array(self._frames[index]))
            yield Frame(index, time_s, image, stamp_s=stamp_s)


def _checked(
    times: ArrayLike | None, what: str, count: int, name: str
) -> NDArray[np.float64] | None:
    """Times (n,) of n frames. Raises FrameSourceError if they are of another kind or number."""
    if times is None:
        return None
    found = np.asarray(times)
    if found.shape != (count,) or found.dtype.kind not in "iuf" or not np.isfinite(found).all():
        raise FrameSourceError(
            f"{name}: {what} of {found.dtype} {found.shape} for {count} frames; need ({count},) "
            "finite numbers"
        )
    return found.astype(np.float64)


def read_frame_array(path: str | os.PathLike[str], frames_per_s: float | None = None) -> FrameArray:
    """Return the frames of an `.npy` or `.npz` file.

    In an `.npz` file the frames are the array named frames or images, or the only uint8 array of
    3 or 4 axes; the arrays time_s and stamp_s, if present, hold their times and their seconds since
    1970. Raises FrameSourceError if the file holds no frames.
    """
    file = Path(path)
    try:
        if file.suffix.lower() == ".npy":
            loaded = np.load(file, allow_pickle=False, mmap_mode="r")
            return FrameArray(loaded, None, frames_per_s, str(file))
        with np.load(file, allow_pickle=False) as archive:
            key = _frames_key(archive, file)
            times = next((archive[k] for k in _TIMES if k in archive.files), None)
            stamps = next((archive[k] for k in _STAMPS if k in archive.files), None)
            return FrameArray(archive[key], times, frames_per_s, str(file), stamps)
    except FrameSourceError:
        raise
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error, KeyError) as error:
        reason = " ".join(str(getattr(error, "strerror", None) or error).split())[:200]
        raise FrameSourceError(f"{file}: not a readable NumPy file: {reason}") from error


def _frames_key(archive: Any, file: Path) -> str:
    for key in _KEYS:
        if key in archive.files:
            return key
    deep = [k for k in archive.files if archive[k].ndim >= 3 and archive[k].dtype == np.uint8]
    if len(deep) == 1:
        return str(deep[0])
    raise FrameSourceError(
        f"{file}: none of its arrays ({', '.join(archive.files) or 'none'}) is known to hold the "
        "frames; name that array 'frames'"
    )
