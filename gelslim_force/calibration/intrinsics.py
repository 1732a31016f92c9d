"""The lens as a camera calibration measured it, before the camera was built into the finger.

One picture of a flat print hardly distinguishes a longer lens from a nearer gel. Pictures of a
chessboard in many poses do. Their result is read as ROS (`camera_calibration`) or OpenCV
(`FileStorage`) write it, and takes the place of the data sheet in the fit of the built camera.
"""

from __future__ import annotations

import dataclasses
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gelslim_core.yaml.document import Document, parse_document
from gelslim_core.yaml.document import Path as Place
from gelslim_core.yaml.errors import InputError, Problem, shown
from gelslim_core.yaml.source import Source, read_source
from gelslim_force.calibration.camera_deviation import CameraTolerance
from gelslim_force.calibration.error import CalibrationError
from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.virtual_camera import VirtualCamera

SQUARE_PERCENT = 0.5
"""Largest difference between the focal lengths along rows and columns: pixels are square."""
MOST_FOCAL_SIGMAS = 5.0
MEASURED_LENS = CameraTolerance(
    focal_percent=0.15, k1=0.01, k2=0.01, tangential=0.001, principal_share=0.002
)
"""What about a dozen pictures of a chessboard leave open; pose and print as in any built camera."""
_START = "write it with `cameracalibrator` of ROS, or with cv2.FileStorage"
_FROM_OPENCV = re.compile(r"\A%YAML[: ]1\.[0-2]\s*?(?=\n)|!!opencv-(nd-)?matrix")
_SIZES = (("image_width", "width"), ("image_height", "height"))
_MODELS: dict[str, Literal["brown", "kannala_brandt"]] = {
    "plumb_bob": "brown",
    "equidistant": "kannala_brandt",
}
_BROWN, _WIDE = ("k1", "k2", "p1", "p2", "k3"), ("k1", "k2", "k3", "k4")


@dataclass(frozen=True)
class Intrinsics:
    """Focal length, principal point and distortion of a camera, measured on its upright pictures.

    Attributes:
        size_px: Width and height of the pictures.
        focal_px: Image distance over the pixel pitch.
        principal_px: Pixel on the lens axis; pixel centres have whole coordinates.
        distortion: Of the lens.
        tolerance: Standard deviations of the built camera about the design with this lens.
    """

    size_px: tuple[int, int]
    focal_px: float
    principal_px: tuple[float, float]
    distortion: LensDistortion
    tolerance: CameraTolerance = MEASURED_LENS

    def camera(self, design: VirtualCamera) -> VirtualCamera:
        """The design's camera with this lens.

        Args:
            design: The camera as designed.

        Returns:
            A camera at the same place.

        Raises:
            CalibrationError: The lens was measured on pictures of another size, or its focal
                length is not that of the design's lens.
        """
        wide, high = design.image_width_px, design.image_height_px
        if self.size_px != (wide, high):
            raise CalibrationError(
                "size",
                f"the intrinsics are of pictures of {self.size_px[0]} x {self.size_px[1]} px, this "
                f"sensor's are {wide} x {high} px when upright: measure the lens in this mode of "
                "the camera, on upright pictures",
            )
        percent = 100 * (self.focal_px / design.focal_px - 1)
        limit = MOST_FOCAL_SIGMAS * CameraTolerance().focal_percent
        if abs(percent) > limit:
            raise CalibrationError(
                "camera",
                f"the measured focal length is {self.focal_px:.1f} px, the design's lens has "
                f"{design.focal_px:.1f} px when focused on the gel ({percent:+.1f} %, limit "
                f"{limit:g} %): focus the lens as in the finger before it is measured, or make "
                "the bundle for this lens",
            )
        middle = (np.array([wide, high]) - 1) / 2
        x, y = np.array(self.principal_px) - middle
        return dataclasses.replace(
            design,
            focal_px=self.focal_px,
            principal_offset_px=(float(x), float(y)),
            lens=self.distortion if self.distortion.distorts else None,
        )


def read_intrinsics(path: str | os.PathLike[str]) -> Intrinsics:
    """Read the intrinsics of a camera from a YAML file of ROS or OpenCV.

    Args:
        path: File with `image_width`, `image_height`, `camera_matrix`, and
            `distortion_coefficients` of the model `plumb_bob` or `equidistant`.

    Returns:
        The lens.

    Raises:
        InputError: The file cannot be read, or an entry is missing or wrong.
    """
    source = read_source(Path(path))
    plain = _FROM_OPENCV.sub("", source.text)
    document = parse_document(dataclasses.replace(source, text=plain), _START)
    if document.problems:
        raise InputError(tuple(document.problems))
    return _Reader(source, document).intrinsics()


@dataclass(frozen=True)
class _Reader:
    source: Source
    document: Document

    def intrinsics(self) -> Intrinsics:
        width, height = (self._size(names) for names in _SIZES)
        k = self._numbers("camera_matrix", (9,)).reshape(3, 3)
        focal = float(np.sqrt(abs(k[0, 0] * k[1, 1])))
        if min(k[0, 0], k[1, 1]) <= 0 or abs(k[0, 0] - k[1, 1]) > SQUARE_PERCENT / 100 * focal:
            raise self._refused(
                ("camera_matrix",),
                f"has the focal lengths {k[0, 0]:g} and {k[1, 1]:g} px: must be positive and equal "
                f"within {SQUARE_PERCENT:g} %, as pixels are square",
                "calibrate with more pictures, or with the aspect ratio fixed",
            )
        if not (0 <= k[0, 2] < width and 0 <= k[1, 2] < height):
            raise self._refused(
                ("camera_matrix",),
                f"has the principal point ({k[0, 2]:g}, {k[1, 2]:g}) px: must be in the picture",
                "calibrate with more pictures",
            )
        middle = float(k[0, 2]), float(k[1, 2])
        return Intrinsics((width, height), focal, middle, self._distortion())

    def _distortion(self) -> LensDistortion:
        name = self.document.data.get("distortion_model", "plumb_bob")
        if name not in _MODELS:
            raise self._refused(
                ("distortion_model",),
                f"= {shown(str(name))}: must be one of {', '.join(_MODELS)}",
                "calibrate with such a model",
            )
        model = _MODELS[name]
        sizes = (4,) if model == "kannala_brandt" else (4, 5)
        values = self._numbers("distortion_coefficients", sizes)
        names = _WIDE if model == "kannala_brandt" else _BROWN
        given = dict(zip(names, values.tolist(), strict=False))
        return LensDistortion(**given, model=model)

    def _size(self, names: tuple[str, ...]) -> int:
        name = next((n for n in names if n in self.document.data), names[0])
        value = self._value((name,))
        if not (isinstance(value, int) and not isinstance(value, bool) and 16 <= value <= 20_000):
            raise self._refused((name,), "must be a whole number of pixels, at least 16", "")
        return value

    def _numbers(self, name: str, sizes: tuple[int, ...]) -> np.ndarray:
        value: Any = self._value((name,))
        place: Place = (name,)
        if isinstance(value, dict):
            place = (name, "data")
            value = self._value(place)
        flat = value if isinstance(value, list) else []
        flat = [x for row in flat for x in (row if isinstance(row, list) else [row])]
        plain = all(isinstance(x, int | float) and not isinstance(x, bool) for x in flat)
        if not plain or len(flat) not in sizes:
            expected = " or ".join(str(n) for n in sizes)
            raise self._refused(place, f"must be a list of {expected} numbers", _START)
        return np.array(flat, dtype=float)

    def _value(self, place: Place) -> Any:
        try:
            return self.document.value(place)
        except KeyError:
            raise self._refused(place, "is missing", _START) from None

    def _refused(self, place: Place, message: str, remedy: str) -> InputError:
        mark = self.document.marks.get(place)
        line, column = mark.position if mark else (None, None)
        field = ".".join(str(part) for part in place)
        problem = Problem(self.source.path, line, column, field, None, message, remedy)
        return InputError((problem,))
