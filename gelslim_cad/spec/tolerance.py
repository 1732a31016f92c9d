"""What making a finger varies, and what a finger that was made must still keep."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gelslim_cad.spec.limits import above, between
from gelslim_core.yaml.base import Block


class Tolerance(Block):
    """Errors of making a finger that have no field elsewhere; 0 switches one off."""

    print_flatness_mm: float | None = Field(
        default=None,
        ge=0,
        le=1,
        description="Half width (uniform) of the error of a printed seat at each of its ends; left "
        "out: 0.05 for sla, 0.1 for fdm and sls",
    )
    mirror_thickness_mm: float = between(
        0, 1, "Half width (uniform) of mirror glass and glue", default=0.1
    )
    acrylic: Literal["as_bought", "measured"] = Field(
        default="as_bought",
        description="Whether light_guide.thickness_mm is the nominal thickness of a cast sheet "
        "(ISO 7823-1: ± (0.4 mm + a tenth)) or was measured on the sheet",
    )
    acrylic_sheet_mm: float = between(
        0,
        2,
        "Constant part of the half width (uniform) of a cast sheet's thickness; "
        "manufacturing.acrylic_tolerance_ratio is the other",
        default=0.4,
    )
    acrylic_measured_mm: float = between(
        0, 1, "Half width (uniform) of a thickness that was measured", default=0.05
    )
    shim_mm: float = between(
        0,
        1,
        "Half width (uniform) of the free thickness of the shims (ISO 3302-1, class M2: 0.15 mm)",
        default=0.15,
    )
    gel_place_mm: float = between(
        0, 3, "Half width (uniform) of the gel's place on the finger, each axis", default=0.2
    )
    shrinkage_percent: float = between(
        0, 10, "Half width (uniform) of the gel's shrinkage about its stated value", default=0.1
    )
    marker_scale_percent: float = between(
        0, 10, "Half width (uniform) of the scale of the marker print", default=0.2
    )
    marker_jitter_mm: float = between(
        0, 1, "Standard deviation (normal) of the place of the outermost markers", default=0.02
    )
    marker_place_mm: float = between(
        0, 3, "Half width (uniform) of the print's place on the gel, each axis", default=0.2
    )
    focal_length_percent: float = between(
        0, 20, "Half width (uniform) of the lens's focal length", default=0.3
    )
    thread_pitch_mm: float = between(0, 2, "Pitch of the lens's thread", default=0.35)
    lens_turn: float = between(
        0, 1, "Half width (uniform) of the lens's turn when it is set, in turns", default=0.0625
    )
    lens_centring_mm: float = between(
        0, 1, "Standard deviation (normal) of the lens's centre on the sensor", default=0.03
    )
    entrance_pupil_mm: float = between(
        0, 10, "Half width (uniform) of the entrance pupil along the axis", default=0.3
    )
    led_flux_percent: float = between(
        0, 50, "Half width (uniform) of the flux of the LEDs of one colour", default=10.0
    )
    calibration_scale_percent: float = between(
        0, 10, "Standard deviation (normal) of the scale that a calibration finds", default=0.1
    )
    adjusted: bool = Field(
        default=False,
        description="Whether the camera is turned in its clamp, and the lens on its thread, until "
        "the live picture is centred and sharp, before the camera is glued",
    )
    alignment_px: float = between(
        0, 100, "Half width (uniform) of how closely the picture is centred then", default=4.0
    )
    largest_blur_per_diameter: float = above(
        0, 5, "Largest blur of a built finger, in marker diameters", default=0.5
    )
    least_picture_ratio: float = above(
        0,
        1,
        "Pixels per marker of a built finger, at least, as a part of the design's limit; the "
        "keystone may exceed its limit by the inverse",
        default=0.9,
    )
    least_light_ratio: float = above(
        0, 1, "Light of each colour in a built finger, at least, as a part of nominal", default=0.7
    )
