"""The camera: given by its data sheet, never by the design."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any, Literal

from pydantic import ConfigDict, Field, model_validator

from gelslim_cad.spec.distortion import Distortion, require_one_to_one
from gelslim_cad.spec.limits import above, between
from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError
from gelslim_optics.camera.lens_distortion import LensDistortion

LIBRARY = Path(__file__).with_name("cameras")
"""Folder with a file per camera of the library, named as the camera."""
FOV_TOLERANCE = 0.05
NEAREST_FOCUS = 1.5
"""Nearest distance, in focal lengths, for which a sheet's figure is believed."""


@cache
def camera_names() -> tuple[str, ...]:
    """Names of the cameras of the library, in alphabetical order."""
    return tuple(sorted(path.stem for path in LIBRARY.glob("*.yaml")))


def _name_cameras(schema: dict[str, Any]) -> None:
    schema["enum"] = [*camera_names(), None]


def _given_or_from_library(schema: dict[str, Any]) -> None:
    """In the JSON Schema the required fields may be left out where `model` names a camera."""
    required = schema.pop("required")
    schema["anyOf"] = [{"required": ["model"]}, {"required": required}]


class Camera(Block):
    """A camera by its sheet or of the library. Width is across the finger, height along it."""

    model_config = ConfigDict(json_schema_extra=_given_or_from_library)

    model: str | None = Field(
        default=None,
        json_schema_extra=_name_cameras,
        description="Camera of the library (`gelslim cameras`) that gives every field that is "
        "left out here",
    )
    mode: str | None = Field(
        default=None,
        description="Its mode, such as 640x400; the first that `gelslim cameras NAME` lists when "
        "left out",
    )
    name: str = Field(default="camera", max_length=80, description="Camera name, for the BOM")
    orientation: Literal["landscape", "portrait"] = Field(
        default="landscape",
        description="How the module is mounted: the wider axis of the picture is across the finger "
        "in `landscape`, along it in `portrait`; sizes are those as mounted",
    )
    image_width_px: int = between(64, 10000, "Image width (across the finger)")
    image_height_px: int = between(64, 10000, "Image height (along the finger)")
    sensor_width_mm: float = above(0.3, 40, "Width of the sensor area that the image covers")
    sensor_height_mm: float = above(0.3, 40, "Height of the sensor area that the image covers")
    focal_length_mm: float = between(0.3, 50, "Focal length of the lens")
    f_number: float = between(0.7, 64, "Focal ratio N")
    horizontal_fov_deg: float | None = Field(
        default=None,
        gt=1,
        lt=170,
        description="Horizontal field of view of the data sheet, which holds at infinity unless "
        "field_of_view_at_mm says otherwise; derived from sensor and focal length when left out",
    )
    vertical_fov_deg: float | None = Field(
        default=None,
        gt=1,
        lt=170,
        description="Vertical field of view of the data sheet, at the same distance; derived from "
        "sensor and focal length when left out",
    )
    field_of_view_at_mm: float | None = Field(
        default=None,
        gt=0,
        le=1e6,
        description="Distance at which the field of view holds; infinity when left out",
    )
    distortion: Distortion = Field(
        default=Distortion(), description="Distortion of the lens; none when left out"
    )
    focusing: Literal["unit", "internal", "fixed"] = Field(
        default="unit",
        description="How the lens is focused: `unit` moves the whole lens, as board cameras do; "
        "`internal` moves a group inside; `fixed` cannot be focused",
    )
    focus_distance_mm: float | None = Field(
        default=None, gt=0, le=1e6, description="Distance in focus of a lens that is fixed"
    )
    focus_nearest_mm: float = above(
        0, 1e6, "Nearest distance in focus as delivered", default=1000.0
    )
    lens_travel_mm: float = between(
        0, 20, "How far the lens can be unscrewed from its delivered position", default=0.6
    )
    circle_of_confusion_px: float = above(
        0, 50, "Blur diameter on the sensor still counted as sharp", default=1.5
    )
    module_width_mm: float = between(1, 80, "Housing size across the finger", default=8.5)
    module_height_mm: float = between(
        1, 80, "Housing size across the finger's thickness", default=8.5
    )
    module_depth_mm: float = between(
        0.5, 80, "Housing depth along the optical axis, no lens", default=4.0
    )
    lens_diameter_mm: float = between(0.5, 60, "Outer diameter of the lens barrel", default=6.0)
    lens_height_mm: float = between(
        0, 60, "How far the lens stands proud of the housing", default=1.5
    )
    entrance_pupil_mm: float | None = Field(
        default=None,
        ge=-80,
        le=60,
        description="Entrance pupil before the front face of the housing, the lens focused on "
        "infinity; the front of the lens when left out",
    )
    cable_kind: Literal["flat", "round"] = Field(
        default="flat", description="Whether the cable is flat, or round with its width as diameter"
    )
    cable_width_mm: float = above(0, 60, "Width of the cable", default=6.0)
    cable_thickness_mm: float = above(0, 10, "Thickness of a flat cable", default=0.15)
    cable_bend_radius_mm: float = between(0, 50, "Smallest bend radius of the cable", default=3.0)
    cable_exit: Literal["rear", "top", "bottom"] = Field(
        default="rear",
        description="Where the cable leaves the module as it is mounted: at the middle of its rear "
        "face, or in its plane at the edge towards the gel (top) or the cover (bottom)",
    )
    cable_length_mm: float | None = above(
        0, 5000, "Length of the cable from the module to the end of its connector", default=None
    )
    connector_width_mm: float = above(0, 80, "Far end of the cable: width", default=11.5)
    connector_thickness_mm: float = above(0, 30, "Far end of the cable: thickness", default=0.3)
    connector_length_mm: float = above(0, 60, "Far end of the cable: length", default=5.0)
    picture: Literal["colour", "mono"] = Field(
        default="colour", description="What the sensor tells apart: colours, or brightness alone"
    )
    frame_rate_hz: float = above(0, 5000, "Highest frame rate at this image size", default=90.0)
    quantum_efficiency: float = above(
        0, 1, "Electrons per photon, colour filter included", default=0.3
    )
    full_well_e_um2: float = above(
        0, 1e5, "Full well per µm² of sensor, in electrons", default=2200.0
    )
    lens_transmission: float = above(0, 1, "Part of the light that the lens passes", default=0.9)

    @model_validator(mode="after")
    def _consistent(self) -> Camera:
        if self.mode is not None and self.model is None:
            raise FieldError(
                "mode",
                "belongs to a camera of the library, and model names none",
                "give model too, or leave mode out and give the fields themselves",
            )
        self._check_orientation()
        if self.lens_diameter_mm > self.module_width_mm:
            raise FieldError(
                "lens_diameter_mm",
                f"must be at most module_width_mm ({self.module_width_mm:g} mm)",
                "change lens_diameter_mm or module_width_mm",
                ("module_width_mm",),
            )
        self._check_focusing()
        self._check_field_of_view()
        square = (self.image_width_px / self.image_height_px) / (
            self.sensor_width_mm / self.sensor_height_mm
        )
        if not 0.98 < square < 1.02:
            raise FieldError(
                "image_width_px",
                "pixels are not square: image_width_px / image_height_px and sensor_width_mm / "
                "sensor_height_mm differ by more than 2 %",
                "give the area of the sensor that the image covers",
                ("image_height_px", "sensor_width_mm", "sensor_height_mm"),
            )
        return self

    def _check_orientation(self) -> None:
        """The wider axis of the picture lies across the finger, or in portrait along it."""
        wide, high = self.image_width_px, self.image_height_px
        if self.orientation == "portrait" and high <= wide:
            raise FieldError(
                "orientation",
                f"is portrait, and image_height_px ({high}) is not above image_width_px ({wide})",
                "give picture, sensor and housing as they are mounted, turned by 90 degrees",
                ("image_height_px",),
            )
        if self.orientation == "landscape" and high > wide:
            raise FieldError(
                "image_height_px",
                f"must be at most image_width_px ({wide})",
                "the wider axis lies across the finger: swap the two, and the sensor sides, or "
                "give orientation: portrait",
                ("image_width_px",),
            )

    def _check_focusing(self) -> None:
        """Each way to focus has the figures that it needs, and the pupil lies in the camera."""
        if self.focusing == "internal" and None in (
            self.horizontal_fov_deg,
            self.field_of_view_at_mm,
        ):
            raise FieldError(
                "focusing",
                "is internal, and the scale of such a lens does not follow from its focal length",
                "give horizontal_fov_deg and the distance at which it holds, field_of_view_at_mm",
                ("horizontal_fov_deg", "field_of_view_at_mm"),
            )
        if (self.focusing == "fixed") != (self.focus_distance_mm is not None):
            raise FieldError(
                "focus_distance_mm",
                "belongs to a lens that cannot be focused, and is needed there",
                "give focus_distance_mm with focusing: fixed, and only there",
                ("focusing",),
            )
        for name in ("field_of_view_at_mm", "focus_distance_mm"):
            value = getattr(self, name)
            if value is not None and value < NEAREST_FOCUS * self.focal_length_mm:
                raise FieldError(
                    name,
                    f"must be at least {NEAREST_FOCUS:g} focal lengths "
                    f"({NEAREST_FOCUS * self.focal_length_mm:g} mm)",
                    "give the distance from the lens in mm",
                    ("focal_length_mm",),
                )
        pupil = self.entrance_pupil_mm
        if pupil is not None and not -self.module_depth_mm <= pupil <= self.lens_height_mm:
            raise FieldError(
                "entrance_pupil_mm",
                f"must lie in the camera, from {-self.module_depth_mm:g} mm (the housing's rear) "
                f"to {self.lens_height_mm:g} mm (the front of the lens)",
                "measure it from the front face of the housing, positive towards the object",
                ("lens_height_mm", "module_depth_mm"),
            )

    def _check_field_of_view(self) -> None:
        """The sheet's field of view agrees with sensor, focal length and distortion, if it must."""
        image_mm, lens = self._sheet_lens()
        tans = self.sensor_width_mm / 2 / image_mm, self.sensor_height_mm / 2 / image_mm
        require_one_to_one(lens, tans[0], tans[1], image_mm, f"distortion.{self.distortion.stated}")
        if self.focusing == "internal":
            return
        for axis, tan, given in (
            ("horizontal", (tans[0], 0.0), self.horizontal_fov_deg),
            ("vertical", (0.0, tans[1]), self.vertical_fov_deg),
        ):
            seen = math.hypot(*lens.undistort([tan])[0])
            implied = math.degrees(2 * math.atan(seen))
            if given is not None and abs(given - implied) > FOV_TOLERANCE * implied:
                raise FieldError(
                    f"{axis}_fov_deg",
                    "disagrees with sensor size, focal length and distortion, "
                    f"which give {implied:.2f} degrees",
                    "correct one of them or leave the field of view out",
                    ("focal_length_mm",),
                )

    def _sheet_lens(self) -> tuple[float, LensDistortion]:
        """Image distance at which the sheet's field of view holds, and the distortion."""
        width, height = self.sensor_width_mm / 2, self.sensor_height_mm / 2
        at, f = self.field_of_view_at_mm, self.focal_length_mm
        image_mm = f if at is None else f * at / (at - f)
        if self.focusing != "internal" or self.horizontal_fov_deg is None:
            return image_mm, self.distortion.lens(width / image_mm, height / image_mm)
        side = math.tan(math.radians(self.horizontal_fov_deg) / 2)
        lens = self.distortion.lens(side, side * height / width)
        return width / side / lens.scale(side), lens
