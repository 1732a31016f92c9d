"""The reference picture from files: one picture, an array, or several pictures to average."""

from __future__ import annotations

import os
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.error import CalibrationError
from gelslim_force.frames.frame import FrameSourceError
from gelslim_force.frames.frame_array import read_frame_array
from gelslim_force.frames.picture import PICTURE_ENDINGS, PictureError, read_picture
from gelslim_force.frames.sample_file import is_sample

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
        return _mean([p for f in files[:MOST_PICTURES] for p in _pictures(f)], place)
    if not place.is_file():
        raise CalibrationError("file", f"{place}: no such file; give a picture without contact")
    return _mean(_pictures(place), place)


def _pictures(file: Path) -> list[NDArray[np.uint8]]:
    """The pictures of one file."""
    try:
        if file.suffix.lower() != ".npy" or is_sample(file):
            return [read_picture(file)]
        frames = islice(read_frame_array(file), MOST_PICTURES)
        return [frame.image for frame in frames if frame.image is not None]
    except (PictureError, FrameSourceError) as error:
        raise CalibrationError("file", f"{file}: {error}") from error


def _mean(pictures: list[NDArray[np.uint8]], place: Path) -> NDArray[np.uint8]:
    shapes = {picture.shape for picture in pictures}
    if len(shapes) > 1:
        raise CalibrationError(
            "file", f"{place}: pictures of different sizes, {sorted(shapes, key=str)}"
        )
    return np.rint(np.mean(pictures, axis=0)).astype(np.uint8)
