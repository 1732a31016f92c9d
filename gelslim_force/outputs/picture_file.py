"""Pictures enlarged and turned into the bytes of a file, by OpenCV or Pillow."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.output_error import OutputError
from gelslim_force.outputs import optional_library

Image = NDArray[np.uint8]
_PURPOSE = "writing pictures"


def enlarged(image: Image, factor: int) -> Image:
    """Return (f h, f w, 3), cubic between pixels. Raises OutputError without a library for it."""
    if factor == 1:
        return image
    height, width = image.shape[:2]
    size = (width * factor, height * factor)
    if optional_library.available("cv2"):
        cv = optional_library.load("cv2", "vision", _PURPOSE)
        return np.asarray(cv.resize(image, size, interpolation=cv.INTER_CUBIC), dtype=np.uint8)
    pillow = optional_library.load("PIL.Image", "vision", _PURPOSE)
    return np.asarray(pillow.fromarray(image).resize(size, pillow.Resampling.BICUBIC))


def encoded(image: Image, suffix: str, quality: int = 92) -> bytes:
    """Return an RGB picture (h, w, 3) as a PNG or JPEG file.

    Raises OutputError for another ending or where neither OpenCV nor Pillow is installed.
    """
    kind = suffix.lower()
    if kind not in (".png", ".jpg", ".jpeg"):
        raise OutputError(f"picture ending {suffix!r}: must be .png, .jpg or .jpeg")
    if optional_library.available("cv2"):
        cv = optional_library.load("cv2", "vision", _PURPOSE)
        # Camera noise has no repeats worth searching for: runs alone pack it a tenth smaller, in a
        # sixth of the time.
        runs = [cv.IMWRITE_PNG_COMPRESSION, 6]
        runs += [cv.IMWRITE_PNG_STRATEGY, cv.IMWRITE_PNG_STRATEGY_RLE]
        choice = runs if kind == ".png" else [cv.IMWRITE_JPEG_QUALITY, quality]
        fine, data = cv.imencode(kind, np.ascontiguousarray(image[:, :, ::-1]), choice)
        if not fine:
            raise OutputError(f"OpenCV could not encode a picture of {image.shape} as {kind}")
        return bytes(data)
    pillow = optional_library.load("PIL.Image", "vision", _PURPOSE)
    out = io.BytesIO()
    if kind == ".png":
        pillow.fromarray(image).save(out, "PNG")
    else:
        pillow.fromarray(image).save(out, "JPEG", quality=quality)
    return out.getvalue()
