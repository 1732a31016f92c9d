"""The camera: given by its data sheet, never by the design."""

from __future__ import annotations

import math

from pydantic import Field, model_validator

from gelslim_cad.spec.limits import above, between
from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError

FOV_TOLERANCE = 0.05


class Camera(Block):
    """Camera parameters as in a data sheet. The wider image axis lies across the finger."""

    name: str = Field(default="camera", max_length=80, description="Camera name, for the BOM")
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
        description="Horizontal field of view; derived from sensor and focal length when left out",
    )
    vertical_fov_deg: float | None = Field(
        default=None,
        gt=1,
        lt=170,
        description="Vertical field of view; derived from sensor and focal length when left out",
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
    cable_width_mm: float = above(0, 60, "Width of the flat cable", default=6.0)
    cable_bend_radius_mm: float = between(0, 50, "Smallest bend radius of the cable", default=3.0)
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
