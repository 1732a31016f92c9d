"""The reference picture from files: one picture, an array, or several pictures to average."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.error import CalibrationError
from gelslim_force.frames.picture import PICTURE_ENDINGS, PictureError, read_picture

MOST_PICTURES = 100
"""Most pictures that are averaged: a tenth of the noise remains."""


def read_reference(path: str | os.PathLike[str]) -> NDArray[np.uint8]:
    """Read a picture without contact.

    Args:
        path: A picture, a NumPy file with (h, w[, 3]) or (n, h, w, 3), or a folder of these.
            Several pictures of the gel at rest are averaged, which reduces noise.

    Returns:
        (h, w) or (h, w, 3) uint8, channels in the order red, green, blue.

    Raises:
        CalibrationError: The file cannot be read.
        MissingLibraryError: A picture file needs Pillow, which is not installed.
    """
    place = Path(path)
    if place.is_dir():
        files = sorted(f for f in place.iterdir() if f.suffix.lower() in PICTURE_ENDINGS)
        if not files:
            raise CalibrationError(
                "file", f"{place}: no pictures in it ({', '.join(PICTURE_ENDINGS)})"
            )
        return _mean([_frames(f) for f in files[:MOST_PICTURES]], place)
    if not place.is_file():
        raise CalibrationError("file", f"{place}: no such file; give a picture without contact")
    return _mean([_frames(place)], place)


def _frames(file: Path) -> NDArray[np.uint8]:
    """Pictures (n, h, w) or (n, h, w, 3) of one file."""
    frames = _array(file) if file.suffix.lower() == ".npy" else _picture(file)
    if frames.dtype != np.uint8 or frames.ndim not in (2, 3, 4) or 0 in frames.shape:
        raise CalibrationError(
            "file",
            f"{file}: an array of {frames.dtype} {frames.shape} is not a picture; give uint8 "
            "(h, w), (h, w, 3) or (n, h, w, 3)",
        )
    single = frames.ndim == 2 or (frames.ndim == 3 and frames.shape[2] <= 4)
    return frames[None] if single else frames[:MOST_PICTURES]


def _array(file: Path) -> NDArray[Any]:
    try:
        return np.asarray(np.load(file, allow_pickle=False, mmap_mode="r"))
    except (OSError, ValueError, EOFError) as error:
        raise CalibrationError(
            "file", f"{file} is not a NumPy array that can be read: {error}"
        ) from error


def _picture(file: Path) -> NDArray[np.uint8]:
    try:
        return read_picture(file)
    except PictureError as error:
        raise CalibrationError("file", f"{file}: {error}") from error


def _mean(stacks: list[NDArray[np.uint8]], place: Path) -> NDArray[np.uint8]:
    shapes = {s.shape[1:] for s in stacks}
    if len(shapes) > 1:
        raise CalibrationError(
            "file", f"{place}: pictures of different sizes, {sorted(shapes, key=str)}"
        )
    total = np.zeros(stacks[0].shape[1:])
    count = 0
    for stack in stacks:
        for frame in stack:
            total += frame
            count += 1
    return np.rint(total / count).astype(np.uint8)
