"""Pictures drawn on, enlarged and encoded as files, by OpenCV. Drawing is antialiased.

Colours are RGB, 0 ... 255. Positions are in px: x to the right, y down, centres of pixels at
integers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_core import optional_library
from gelslim_core.errors import OutputError

Image = NDArray[np.uint8]
Colour = tuple[int, int, int]
Position = tuple[float, float]
_FRACTION_BITS = 4
"""OpenCV takes positions as integers with this many binary digits after the point."""
_ANTIALIASED = 16
_MODE = (_ANTIALIASED, _FRACTION_BITS)
_PURPOSE = "writing pictures"


class Canvas:
    """A copy of a picture (h, w, 3) that is drawn on."""

    def __init__(self, image: Image) -> None:
        """Copy the picture. Raises MissingLibraryError without OpenCV."""
        self._cv = optional_library.load("cv2", "drawing pictures")
        self._image = np.ascontiguousarray(image).copy()
        self._font = self._cv.FontFace("sans") if hasattr(self._cv, "FontFace") else None

    def line(self, start: Position, end: Position, colour: Colour, width_px: float) -> None:
        """Draw a straight line with round ends."""
        ends = (_fixed(start), _fixed(end))
        self._cv.line(self._image, *ends, colour, _whole_px(width_px), *_MODE)

    def polygon(self, corners: NDArray[np.float64], colour: Colour) -> None:
        """Fill a convex outline (k, 2)."""
        fixed = np.rint(np.asarray(corners) * 2**_FRACTION_BITS).astype(np.int32)
        self._cv.fillConvexPoly(self._image, fixed, colour, *_MODE)

    def disc(self, centre: Position, radius_px: float, colour: Colour) -> None:
        """Fill a circle."""
        self._circle(centre, radius_px, colour, -1)

    def ring(self, centre: Position, radius_px: float, colour: Colour, width_px: float) -> None:
        """Draw a circle."""
        self._circle(centre, radius_px, colour, _whole_px(width_px))

    def _circle(self, centre: Position, radius_px: float, colour: Colour, wide: int) -> None:
        radius = round(radius_px * 2**_FRACTION_BITS)
        self._cv.circle(self._image, _fixed(centre), radius, colour, wide, *_MODE)

    def text(self, left_baseline: Position, text: str, colour: Colour, size_px: float) -> None:
        """Write one line; `size_px` is the height of its letters with their descent."""
        at = (round(left_baseline[0]), round(left_baseline[1]))
        if self._font is not None:
            self._cv.putText(self._image, text, at, colour, self._font, round(size_px))
            return
        plain = text.replace("±", "+/-").replace("·", " ").replace("–", "-")
        plain = plain.encode("ascii", "replace").decode()
        self._cv.putText(self._image, plain, at, 0, size_px / 30.0, colour, 1, _ANTIALIASED)

    def picture(self) -> Image:
        """Return the picture with all that was drawn."""
        return self._image


def _fixed(position: Position) -> tuple[int, int]:
    return round(position[0] * 2**_FRACTION_BITS), round(position[1] * 2**_FRACTION_BITS)


def _whole_px(width_px: float) -> int:
    return max(1, round(width_px))


def arrow(
    canvas: Canvas,
    start: Position,
    end: Position,
    colour: Colour,
    width_px: float,
    rim: Colour | None = None,
    least_px: float = 1.5,
) -> None:
    """Draw an arrow with a filled head and a rim; one shorter than `least_px` is left out."""
    tail, tip = np.array(start, dtype=float), np.array(end, dtype=float)
    length = float(np.hypot(*(tip - tail)))
    if not length >= least_px:
        return
    along = (tip - tail) / length
    across = np.array([-along[1], along[0]])
    head = min(0.55 * length, 4.2 * width_px)
    neck = tip - head * along
    for grown, paint in ((1.0, rim), (0.0, colour)):
        if paint is None:
            continue
        half, back = 0.45 * head + 1.5 * grown, neck - grown * along
        canvas.line((tail[0], tail[1]), (neck[0], neck[1]), paint, width_px + 2 * grown)
        point = tip + 2.2 * grown * along
        canvas.polygon(np.array([point, back + half * across, back - half * across]), paint)


def enlarged(image: Image, factor: int) -> Image:
    """Return the picture as (f h, f w, 3) by cubic interpolation.

    Raises MissingLibraryError without OpenCV.
    """
    if factor == 1:
        return image
    cv = optional_library.load("cv2", _PURPOSE)
    height, width = image.shape[:2]
    size = (width * factor, height * factor)
    return np.asarray(cv.resize(image, size, interpolation=cv.INTER_CUBIC), dtype=np.uint8)


def encoded(image: Image, suffix: str, quality: int = 92) -> bytes:
    """Return an RGB picture (h, w, 3), or a grey one (h, w), as a PNG or JPEG file.

    Raises OutputError for another suffix, MissingLibraryError without OpenCV.
    """
    kind = suffix.lower()
    if kind not in (".png", ".jpg", ".jpeg"):
        raise OutputError(f"picture ending {suffix!r}: must be .png, .jpg or .jpeg")
    cv = optional_library.load("cv2", _PURPOSE)
    # Camera noise has few repetitions: run-length coding alone packs it a tenth smaller, in a
    # sixth of the time.
    png = [cv.IMWRITE_PNG_COMPRESSION, 6, cv.IMWRITE_PNG_STRATEGY, cv.IMWRITE_PNG_STRATEGY_RLE]
    options = png if kind == ".png" else [cv.IMWRITE_JPEG_QUALITY, quality]
    success, data = cv.imencode(
        kind, np.ascontiguousarray(image[..., ::-1] if image.ndim == 3 else image), options
    )
    if not success:
        raise OutputError(f"OpenCV could not encode a picture of {image.shape} as {kind}")
    return bytes(data)
