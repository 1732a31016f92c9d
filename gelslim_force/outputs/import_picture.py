"""A picture of an imported sensor: its dots, the lattice that the fitted camera sees, its gel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.outputs.canvas import Canvas, Image, arrow, encoded, enlarged
from ifem_export.mesh.outline import RoundedRectangle

Array = NDArray[np.float64]
_LEAST_HEIGHT_PX = 900
_DIM = 0.75
_WHITE, _YELLOW, _CYAN, _RED = (255, 255, 255), (255, 221, 64), (64, 224, 255), (255, 80, 64)
_POINTS = 48


def import_picture(calibration: Calibration, outline: RoundedRectangle) -> bytes:
    """Draw the reference picture with what was found in it, as PNG.

    Rings are the dots, crosses the lattice as the camera sees it, the line is the gel's outline,
    and two arrows of three pitches show x and y from the gel's middle.

    Args:
        calibration: With its picture.
        outline: The gel seen from above.

    Raises:
        ValueError: The calibration keeps no picture.
    """
    picture = calibration.picture
    if picture is None:
        raise ValueError("the calibration keeps no picture")
    zoom = int(np.clip(-(-_LEAST_HEIGHT_PX // picture.shape[0]), 1, 8))
    canvas = Canvas(_dimmed(picture, zoom))

    def seen(places: Array) -> Array:
        flat = np.column_stack([places, np.zeros(len(places))])
        return (calibration.camera.project(flat) + 0.5) * zoom - 0.5

    corners = seen(outline_mm(outline))
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        canvas.line(_place(start), _place(end), _WHITE, 2.0)
    radius = zoom * 1.5 * float(np.sqrt(np.median(calibration.dots.area_px) / np.pi))
    for dot in (calibration.reference_px + 0.5) * zoom - 0.5:
        canvas.ring(_place(dot), radius, _CYAN, 2.0)
    for site in seen(calibration.grid.positions_mm):
        for step in ((4.0, 0.0), (0.0, 4.0)):
            canvas.line(_place(site - step), _place(site + step), _YELLOW, 2.0)
    reach = 3 * calibration.grid.pitch_mm
    middle, along, across = seen(np.array([[0.0, 0.0], [reach, 0.0], [0.0, reach]]))
    for end, name in ((along, "x"), (across, "y")):
        arrow(canvas, _place(middle), _place(end), _RED, 3.0)
        canvas.text(_place(end + 8), name, _WHITE, 36.0)
    return encoded(canvas.picture(), ".png")


def outline_mm(outline: RoundedRectangle) -> Array:
    """Points (k, 2) of an outline, in order."""
    r = outline.corner_radius_mm
    x, y = outline.length_mm / 2 - r, outline.width_mm / 2 - r
    turn = np.linspace(0, np.pi / 2, max(2, _POINTS // 4))
    arcs = [
        np.column_stack([cx + r * np.cos(turn + start), cy + r * np.sin(turn + start)])
        for cx, cy, start in ((x, y, 0), (-x, y, np.pi / 2), (-x, -y, np.pi), (x, -y, 1.5 * np.pi))
    ]
    return np.vstack(arcs)


def _dimmed(picture: NDArray[np.uint8], zoom: int) -> Image:
    colour = picture if picture.ndim == 3 else np.repeat(picture[..., None], 3, axis=2)
    return enlarged(np.asarray(colour * _DIM, dtype=np.uint8), zoom)


def _place(position: Array) -> tuple[float, float]:
    return float(position[0]), float(position[1])
