"""Antialiased drawing on a picture, by OpenCV where it is installed, else by Pillow.

Colours are RGB 0 ... 255; places are px (x right, y down, pixel centres at integers).
"""

from __future__ import annotations

from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.output_error import OutputError
from gelslim_force.outputs import optional_library

Image = NDArray[np.uint8]
Colour = tuple[int, int, int]
Place = tuple[float, float]
Backend = Literal["auto", "opencv", "pillow"]


class Canvas(Protocol):
    """A picture being drawn on."""

    def line(self, start: Place, end: Place, colour: Colour, width_px: float) -> None:
        """A straight line with round ends."""

    def polygon(self, corners: NDArray[np.float64], colour: Colour) -> None:
        """A filled convex outline (k, 2)."""

    def disc(self, centre: Place, radius_px: float, colour: Colour) -> None:
        """A filled circle."""

    def ring(self, centre: Place, radius_px: float, colour: Colour, width_px: float) -> None:
        """A circle."""

    def text(self, left_baseline: Place, text: str, colour: Colour, size_px: float) -> None:
        """One line of text; `size_px` is the height of its letters with their descent."""

    def picture(self) -> Image:
        """(h, w, 3) with all that was drawn."""


def canvas_on(image: Image, backend: Backend = "auto") -> Canvas:
    """Return a canvas on a copy of an RGB image (h, w, 3).

    Raises OutputError where neither library is installed, or not the one asked for.
    """
    if backend != "pillow" and optional_library.available("cv2"):
        return _OpenCvCanvas(image)
    if backend != "opencv" and optional_library.available("PIL.Image"):
        return _PillowCanvas(image)
    optional_library.load(
        "PIL.Image" if backend == "pillow" else "cv2", "vision", "drawing pictures"
    )
    raise OutputError("no library to draw with")  # pragma: no cover


class _OpenCvCanvas:
    _SHIFT = 4

    def __init__(self, image: Image) -> None:
        self._cv = optional_library.load("cv2", "vision", "drawing pictures")
        self._image = np.ascontiguousarray(image).copy()
        self._font = self._cv.FontFace("sans") if hasattr(self._cv, "FontFace") else None

    def line(self, start: Place, end: Place, colour: Colour, width_px: float) -> None:
        wide = max(1, round(width_px))
        self._cv.line(
            self._image, self._fixed(start), self._fixed(end), colour, wide, 16, self._SHIFT
        )

    def polygon(self, corners: NDArray[np.float64], colour: Colour) -> None:
        fixed = np.rint(np.asarray(corners) * 2**self._SHIFT).astype(np.int32)
        self._cv.fillConvexPoly(self._image, fixed, colour, 16, self._SHIFT)

    def disc(self, centre: Place, radius_px: float, colour: Colour) -> None:
        radius = round(radius_px * 2**self._SHIFT)
        self._cv.circle(self._image, self._fixed(centre), radius, colour, -1, 16, self._SHIFT)

    def ring(self, centre: Place, radius_px: float, colour: Colour, width_px: float) -> None:
        radius, wide = round(radius_px * 2**self._SHIFT), max(1, round(width_px))
        self._cv.circle(self._image, self._fixed(centre), radius, colour, wide, 16, self._SHIFT)

    def text(self, left_baseline: Place, text: str, colour: Colour, size_px: float) -> None:
        at = (round(left_baseline[0]), round(left_baseline[1]))
        if self._font is not None:
            self._cv.putText(self._image, text, at, colour, self._font, round(size_px))
            return
        plain = text.replace("±", "+/-").replace("·", " ").replace("–", "-")
        plain = plain.encode("ascii", "replace").decode()
        self._cv.putText(self._image, plain, at, 0, size_px / 30.0, colour, 1, 16)

    def picture(self) -> Image:
        return self._image

    def _fixed(self, place: Place) -> tuple[int, int]:
        unit = 2**self._SHIFT
        return round(place[0] * unit), round(place[1] * unit)


class _PillowCanvas:
    """Draws on an overlay of twice the size for antialiasing, then blends it in."""

    _FINE = 2

    def __init__(self, image: Image) -> None:
        self._image_module = optional_library.load("PIL.Image", "vision", "drawing pictures")
        draw = optional_library.load("PIL.ImageDraw", "vision", "drawing pictures")
        self._fonts = optional_library.load("PIL.ImageFont", "vision", "drawing pictures")
        fine = np.repeat(np.repeat(image, self._FINE, axis=0), self._FINE, axis=1)
        self._large = self._image_module.fromarray(fine)
        self._draw = draw.Draw(self._large)
        self._texts: dict[int, Any] = {}

    def line(self, start: Place, end: Place, colour: Colour, width_px: float) -> None:
        wide = max(1, round(width_px * self._FINE))
        self._draw.line([self._fine(start), self._fine(end)], colour, wide)

    def polygon(self, corners: NDArray[np.float64], colour: Colour) -> None:
        self._draw.polygon([self._fine((x, y)) for x, y in corners], colour)

    def disc(self, centre: Place, radius_px: float, colour: Colour) -> None:
        self._draw.ellipse(self._box(centre, radius_px), colour)

    def ring(self, centre: Place, radius_px: float, colour: Colour, width_px: float) -> None:
        wide = max(1, round(width_px * self._FINE))
        self._draw.ellipse(self._box(centre, radius_px), outline=colour, width=wide)

    def text(self, left_baseline: Place, text: str, colour: Colour, size_px: float) -> None:
        size = round(0.95 * size_px * self._FINE)
        if size not in self._texts:
            self._texts[size] = self._fonts.load_default(size)
        font = self._texts[size]
        anchor = {"anchor": "ls"} if hasattr(font, "getmask2") else {}
        self._draw.text(self._fine(left_baseline), text, colour, font, **anchor)

    def picture(self) -> Image:
        size = (self._large.width // self._FINE, self._large.height // self._FINE)
        return np.asarray(self._large.resize(size, self._image_module.Resampling.BOX))

    def _fine(self, place: Place) -> Place:
        x, y = ((value + 0.5) * self._FINE - 0.5 for value in place)
        return x, y

    def _box(self, centre: Place, radius_px: float) -> tuple[float, float, float, float]:
        x, y = self._fine(centre)
        r = radius_px * self._FINE
        return x - r, y - r, x + r, y + r


def arrow(
    canvas: Canvas,
    start: Place,
    end: Place,
    colour: Colour,
    width_px: float,
    rim: Colour | None = None,
    least_px: float = 1.5,
) -> None:
    """Draw an arrow with a filled head, and a rim around it; shorter than `least_px`, nothing."""
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
