"""The pictures of presses from a folder, and which of them is the reference."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.reference_picture import read_reference
from gelslim_force.frames.picture import PICTURE_ENDINGS, PictureError, read_picture
from gelslim_force.presses.load_table import Load
from gelslim_force.presses.press_error import PressError

Picture = NDArray[np.uint8]
FileName = str | os.PathLike[str]


def picture_names(folder: FileName) -> tuple[str, ...]:
    """Names of the pictures in a folder, sorted.

    Raises:
        PressError: There is no such folder, or no picture in it.
    """
    place = Path(folder)
    if not place.is_dir():
        raise PressError("picture", f"{place}: no such folder; give the folder of the pictures")
    names = sorted(f.name for f in place.iterdir() if f.suffix.lower() in PICTURE_ENDINGS)
    if not names:
        raise PressError("picture", f"{place}: no pictures in it ({', '.join(PICTURE_ENDINGS)})")
    return tuple(names)


def press_pictures(folder: FileName, names: Sequence[str]) -> dict[str, Picture]:
    """Read pictures of a folder.

    Raises:
        PressError: A picture is not there, or cannot be read.
    """
    place = Path(folder)
    present = picture_names(place)
    found = {}
    for name in names:
        if name not in present:
            some = ", ".join(present[:4]) + (", ..." if len(present) > 4 else "")
            raise PressError("picture", f"{place / name}: no such picture; the folder has {some}")
        try:
            found[name] = read_picture(place / name)
        except PictureError as error:
            raise PressError("picture", f"{place / name}: {error}") from error
    return found


def reference_of(
    folder: FileName, loads: Sequence[Load], reference: FileName | None
) -> tuple[Picture, str]:
    """The picture without contact.

    Args:
        folder: Folder of the presses.
        loads: The table of their loads.
        reference: A picture, or the name of one in the folder; None takes the first picture of
            load 0, or else the first picture of the folder that is not in the table.

    Returns:
        (h, w) or (h, w, 3) uint8, and its name.

    Raises:
        PressError: There is none.
        CalibrationError: The file cannot be read.
    """
    place = Path(folder)
    if reference is not None:
        inside = place / reference
        chosen = inside if inside.is_file() and not Path(reference).exists() else Path(reference)
        return read_reference(chosen), str(chosen)
    listed = {load.picture for load in loads}
    rest = [load.picture for load in loads if load.load_n == 0]
    rest += [name for name in picture_names(place) if name not in listed]
    if not rest:
        raise PressError(
            "picture",
            f"{place}: every picture has a load; add one without contact, with the load 0, or name "
            "it with --reference",
        )
    return press_pictures(place, rest[:1])[rest[0]], rest[0]
