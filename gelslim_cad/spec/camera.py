"""The camera: given by its data sheet, never by the design."""

from __future__ import annotations

import math

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError

FOV_TOLERANCE = 0.05


class Camera(Block):
    """Camera parameters as in a data sheet. The wider image axis lies across the finger."""

    name: str = Field(default="camera", max_length=80, description="Camera name, for the BOM")
    image_width_px: int = Field(ge=64, le=10000, description="Image width (across the finger)")
    image_height_px: int = Field(ge=64, le=10000, description="Image height (along the finger)")
    sensor_width_mm: float = Field(
        gt=0.3, le=40, description="Width of the sensor area that the image covers"
    )
    sensor_height_mm: float = Field(
        gt=0.3, le=40, description="Height of the sensor area that the image covers"
    )
    focal_length_mm: float = Field(ge=0.3, le=50, description="Focal length of the lens")
    f_number: float = Field(ge=0.7, le=64, description="Focal ratio N")
    horizontal_fov_deg: float | None = Field(
        default=None,
        gt=1,
        lt=170,
        description="Horizontal field of view; derived from sensor and focal length when left out",
    )
    vertical_fov_deg: float | None = Field(
        default=None,
        gt=1,
        lt=170,
        description="Vertical field of view; derived from sensor and focal length when left out",
    )
    focus_nearest_mm: float = Field(
        default=1000.0, gt=0, le=1e6, description="Nearest distance in focus as delivered"
    )
    lens_travel_mm: float = Field(
        default=0.6,
        ge=0,
        le=20,
        description="How far the lens can be unscrewed from its delivered position",
    )
    circle_of_confusion_px: float = Field(
        default=1.5, gt=0, le=50, description="Blur diameter on the sensor still counted as sharp"
    )
    module_width_mm: float = Field(
        default=8.5, ge=1, le=80, description="Housing size across the finger"
    )
    module_height_mm: float = Field(
        default=8.5, ge=1, le=80, description="Housing size across the finger's thickness"
    )
    module_depth_mm: float = Field(
        default=4.0, ge=0.5, le=80, description="Housing depth along the optical axis, no lens"
    )
    lens_diameter_mm: float = Field(
        default=6.0, ge=0.5, le=60, description="Outer diameter of the lens barrel"
    )
    lens_height_mm: float = Field(
        default=1.5, ge=0, le=60, description="How far the lens stands proud of the housing"
    )
    cable_width_mm: float = Field(default=6.0, gt=0, le=60, description="Width of the flat cable")
    cable_bend_radius_mm: float = Field(
        default=3.0, ge=0, le=50, description="Smallest bend radius of the cable"
    )
    frame_rate_hz: float = Field(
        default=90.0, gt=0, le=5000, description="Highest frame rate at this image size"
    )
    quantum_efficiency: float = Field(
        default=0.3, gt=0, le=1, description="Electrons per photon, colour filter included"
    )
    full_well_e_um2: float = Field(
        default=2200.0, gt=0, le=1e5, description="Full well per µm² of sensor, in electrons"
    )
    lens_transmission: float = Field(
        default=0.9, gt=0, le=1, description="Part of the light that the lens passes"
    )

    @model_validator(mode="after")
    def _consistent(self) -> Camera:
        if self.image_height_px > self.image_width_px:
            raise FieldError(
                "image_height_px",
                f"must be at most image_width_px ({self.image_width_px})",
                "the wider axis lies across the finger: swap the two, and the sensor sides",
            )
        if self.lens_diameter_mm > self.module_width_mm:
            raise FieldError(
                "lens_diameter_mm",
                f"must be at most module_width_mm ({self.module_width_mm:g} mm)",
                "change lens_diameter_mm or module_width_mm",
                ("module_width_mm",),
            )
        for axis, side_mm, given in (
            ("horizontal", self.sensor_width_mm, self.horizontal_fov_deg),
            ("vertical", self.sensor_height_mm, self.vertical_fov_deg),
        ):
            implied = math.degrees(2 * math.atan(side_mm / 2 / self.focal_length_mm))
            if given is not None and abs(given - implied) > FOV_TOLERANCE * implied:
                raise FieldError(
                    f"{axis}_fov_deg",
                    "disagrees with sensor size and focal length, "
                    f"which give {implied:.2f} degrees",
                    "correct one of them or leave the field of view out",
                )
        square = (self.image_width_px / self.image_height_px) / (
            self.sensor_width_mm / self.sensor_height_mm
        )
        if not 0.98 < square < 1.02:
            raise FieldError(
                "image_width_px",
                "pixels are not square: image_width_px / image_height_px and sensor_width_mm / "
                "sensor_height_mm differ by more than 2 %",
                "give the area of the sensor that the image covers",
            )
        return self
