"""Picture files decoded strictly: a file that is incomplete is refused."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from gelslim_core import optional_library
from gelslim_core.errors import GelslimError
from gelslim_force.frames.frame import Picture

PICTURE_ENDINGS = (
    ".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".ppm", ".pgm", ".webp", ".npy",
)  # fmt: skip
_MAX_PX = 100_000_000


class PictureError(GelslimError, ValueError):
    """A file holds no complete picture; the message does not name the file."""


def read_picture(path: Path) -> Picture:
    """Return the picture, (h, w) or (h, w, 3) uint8 in the order red, green, blue.

    Of 16-bit pictures the upper 8 bits are kept, and alpha is dropped. The orientation in a
    camera's EXIF data is ignored, because the pixels of a sensor do not turn. Raises PictureError
    if the file holds no complete picture, MissingLibraryError without Pillow.
    """
    try:
        if path.suffix.lower() == ".npy":
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
