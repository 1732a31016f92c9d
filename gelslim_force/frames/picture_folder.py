"""A folder of pictures as frames, in the natural order of their names."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from gelslim_force.frames.frame import Frame, FrameSource, FrameSourceError, size_problem
from gelslim_force.frames.picture import PICTURE_ENDINGS, PictureError, read_picture

_SAMPLE = 5
"""Readable pictures from which the size of all is taken."""
_NUMBER = re.compile(r"(\d+)")


class PictureFolder(FrameSource):
    """Pictures of a folder, or one picture; a damaged file gives a frame with a problem."""

    def __init__(self, path: str | os.PathLike[str], frames_per_s: float | None = None) -> None:
        """List the pictures; their size is the most frequent one of the first five readable ones.

        Raises FrameSourceError if there is no picture, or none that can be read.
        """
        place = Path(path)
        self.frames_per_s = frames_per_s
        self.files = [place] if place.is_file() else _pictures(place)
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


def _pictures(folder: Path) -> list[Path]:
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
