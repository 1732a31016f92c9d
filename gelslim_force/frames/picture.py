"""Picture files decoded strictly: half a picture is none."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from gelslim_core.errors import GelslimError
from gelslim_force.frames.frame import FrameSourceError, Picture, with_vision

PICTURE_ENDINGS = (
    ".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".ppm", ".pgm", ".webp", ".npy",
)  # fmt: skip
_MOST_PX = 100_000_000


class PictureError(GelslimError, ValueError):
    """A file that holds no whole picture; the message leaves out the file's name."""


def read_picture(path: Path) -> Picture:
    """Return the picture, (h, w) or (h, w, 3) uint8 in the order red, green, blue.

    16-bit pictures keep their upper 8 bits, alpha is dropped, and a camera's note on how it was
    held (EXIF) is not followed: a sensor's pixels stay where they are. Raises PictureError for
    what is no whole picture, FrameSourceError where no library reads pictures.
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
    """Return an array as a picture, without alpha. Raises PictureError for another kind."""
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
    try:
        from PIL import Image
    except ImportError:
        return _decoded_by_opencv(data)
    try:
        with Image.open(io.BytesIO(data)) as picture:
            if picture.width * picture.height > _MOST_PX:
                raise PictureError(f"{picture.width} x {picture.height} px are no frame")
            picture.load()
            if picture.mode.startswith("I;16") or picture.mode in ("I", "F"):
                return _eight_bits(np.asarray(picture))
            grey = picture.mode in ("L", "LA", "1")
            return np.asarray(picture.convert("L" if grey else "RGB"))
    except PictureError:
        raise
    except Exception as error:
        # Damaged files raise whatever a decoder trips over: OSError, SyntaxError, struct.error.
        raise PictureError(f"damaged, or no picture: {_reason(error)}") from error


def _eight_bits(deep: Any) -> Any:
    if deep.dtype.kind not in "iu" or deep.size == 0 or deep.min() < 0 or deep.max() > 65535:
        raise PictureError(f"pixels of {deep.dtype} are neither 8 nor 16 bits of grey")
    return (deep >> 8).astype(np.uint8)


def _decoded_by_opencv(data: bytes) -> Any:
    try:
        import cv2
    except ImportError as error:
        raise with_vision("reading pictures", error) from error
    # OpenCV fills what a cut file lacks with grey.
    if data[:2] == b"\xff\xd8" and b"\xff\xd9" not in data[-1024:]:
        raise PictureError("damaged: the JPEG file has no end")
    if data[:4] == b"\x89PNG" and b"IEND" not in data[-64:]:
        raise PictureError("damaged: the PNG file has no end")
    flags = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        found = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    except cv2.error as error:
        raise PictureError(f"damaged, or no picture: {_reason(error)}") from error
    if found is None:
        raise PictureError("damaged, or no picture")
    return found[:, :, ::-1] if found.ndim == 3 else found


def _reason(error: BaseException) -> str:
    if isinstance(error, FrameSourceError):
        return str(error)
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return " ".join(str(text).split())[:200]
