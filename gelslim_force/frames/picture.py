"""Picture files as frames, decoded strictly: a file that is incomplete is refused.

The pictures of a folder come in the natural order of their names.
"""

from __future__ import annotations

import io
import os
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from gelslim_core import optional_library
from gelslim_core.errors import GelslimError
from gelslim_force.frames.frame import Frame, FrameSource, FrameSourceError, Picture, size_problem
from gelslim_force.frames.sample_file import is_sample, read_sample, sample_picture

PICTURE_ENDINGS = (
    ".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".ppm", ".pgm", ".webp", ".npy",
)  # fmt: skip
_MAX_PX = 100_000_000
_SAMPLE = 5
"""Readable pictures from which the size of all is taken."""
_NUMBER = re.compile(r"(\d+)")


class PictureError(GelslimError, ValueError):
    """A file holds no complete picture; the message does not name the file."""


def read_picture(path: Path) -> Picture:
    """Return the picture, (h, w) or (h, w, 3) uint8 in the order red, green, blue.

    A NumPy file holds an array, or a sample of a public data set with its picture. Of 16-bit
    pictures the upper 8 bits are kept, and alpha is dropped. The orientation in a
    camera's EXIF data is ignored, because the pixels of a sensor do not turn. Raises PictureError
    if the file holds no complete picture, MissingLibraryError without Pillow.
    """
    try:
        if path.suffix.lower() == ".npy":
            if is_sample(path):
                return as_picture(sample_picture(read_sample(path)))
            return as_picture(np.load(path, allow_pickle=False))
        data = path.read_bytes()
    except (OSError, ValueError, EOFError) as error:
        raise PictureError(f"cannot be read: {_reason(error)}") from error
    if not data:
        raise PictureError("the file is empty")
    return as_picture(_decoded(data))


def as_picture(array: Any) -> Picture:
    """Return an array as a picture without alpha. Raises PictureError if it is no picture."""
    found = np.asarray(array)
    if found.ndim == 3 and found.shape[2] == 1:
        found = found[:, :, 0]
    elif found.ndim == 3 and found.shape[2] == 4:
        found = found[:, :, :3]
    right = found.ndim == 2 or (found.ndim == 3 and found.shape[2] == 3)
    if found.dtype != np.uint8 or not right or 0 in found.shape:
        raise PictureError(
            f"an array of {found.dtype} {found.shape} is no picture; give uint8 (h, w) or (h, w, 3)"
        )
    return np.ascontiguousarray(found)


def _decoded(data: bytes) -> Any:
    pillow = optional_library.load("PIL.Image", "reading pictures")
    try:
        with pillow.open(io.BytesIO(data)) as picture:
            if picture.width * picture.height > _MAX_PX:
                raise PictureError(f"{picture.width} x {picture.height} px are too large a picture")
            picture.load()
            if picture.mode.startswith("I;16") or picture.mode in ("I", "F"):
                return _eight_bits(np.asarray(picture))
            grey = picture.mode in ("L", "LA", "1")
            return np.asarray(picture.convert("L" if grey else "RGB"))
    except PictureError:
        raise
    except Exception as error:
        # A damaged file makes decoders raise OSError, SyntaxError, struct.error and others.
        raise PictureError(f"damaged, or no picture: {_reason(error)}") from error


def _eight_bits(deep: Any) -> Any:
    if deep.dtype.kind not in "iu" or deep.size == 0 or deep.min() < 0 or deep.max() > 65535:
        raise PictureError(f"pixels of {deep.dtype} are neither 8 nor 16 bits of grey")
    return (deep >> 8).astype(np.uint8)


def _reason(error: BaseException) -> str:
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return " ".join(str(text).split())[:200]


class PictureFolder(FrameSource):
    """Pictures of a folder, or one picture; a damaged file gives a frame with a problem."""

    def __init__(self, path: str | os.PathLike[str], frames_per_s: float | None = None) -> None:
        """List the pictures; their size is the most frequent one of the first five readable ones.

        Raises FrameSourceError if there is no picture, or none that can be read.
        """
        place = Path(path)
        self.frames_per_s = frames_per_s
        self.files = [place] if place.is_file() else pictures_of(place)
        self.count = len(self.files)
        self.shape = self._usual_shape(place)

    def __iter__(self) -> Iterator[Frame]:
        """Yield a frame per file."""
        for index, file in enumerate(self.files):
            time_s = index / (self.frames_per_s or 1.0)
            try:
                image = read_picture(file)
                problem = size_problem(image, self.shape)
            except PictureError as error:
                problem = str(error)
            if problem:
                yield Frame(index, time_s, None, f"{file.name}: {problem}", file.name)
            else:
                yield Frame(index, time_s, image, name=file.name)

    def _usual_shape(self, place: Path) -> tuple[int, ...]:
        shapes: list[tuple[int, ...]] = []
        first_problem = ""
        for file in self.files:
            try:
                shapes.append(read_picture(file).shape)
            except PictureError as error:
                first_problem = first_problem or f"{file.name} {error}"
            if len(shapes) == _SAMPLE:
                break
        if not shapes:
            raise FrameSourceError(
                f"{place}: none of the {len(self.files)} pictures can be read ({first_problem})"
            )
        return Counter(shapes).most_common(1)[0][0]


def pictures_of(folder: Path) -> list[Path]:
    """Pictures of a folder, frame2 before frame10.

    Raises FrameSourceError if the folder cannot be read or has none.
    """
    try:
        names = [entry.name for entry in os.scandir(folder) if entry.is_file()]
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise FrameSourceError(f"{folder}: {reason}; give a folder of pictures") from error
    # Hidden files are left behind by file managers and copying programs.
    chosen = [n for n in names if n.lower().endswith(PICTURE_ENDINGS) and not n.startswith(".")]
    if not chosen:
        raise FrameSourceError(
            f"{folder}: no pictures in the folder ({', '.join(PICTURE_ENDINGS)})"
        )
    return [folder / name for name in sorted(chosen, key=natural_key)]


def natural_key(name: str) -> tuple[tuple[int, int, str], ...]:
    """Return a sorting key that puts frame2 before frame10.

    Digits are compared by value and letters without their case; equal keys by the text itself.
    """
    parts: list[tuple[int, int, str]] = []
    for part in _NUMBER.split(name):
        if part.isdecimal():
            parts.append((0, int(part), ""))
        elif part:
            parts.append((1, 0, part.casefold()))
    return (*parts, (-1, 0, name))
