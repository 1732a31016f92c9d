"""The designer's independent variables; the dependent ones follow and never stand here."""

from __future__ import annotations

import itertools
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from gelslim_cad.spec.housing import Housing, Mount
from gelslim_cad.spec.led_library import completed_leds
from gelslim_cad.spec.limits import above, between
from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError

COLOURS = ("red", "green", "blue")
"""Colours of the strips, one each where there are three."""


class Gel(Block):
    """The soft pad."""

    length_mm: float = between(5, 120, "Gel size along the finger")
    width_mm: float = between(5, 120, "Gel size across the finger")
    thickness_mm: float = Field(
        default=2.0, gt=0, ge=0.3, le=15, description="Gel thickness at its edge"
    )
    corner_radius_mm: float = between(0, 60, "Corner radius of the gel outline", default=2.0)
    crown_height_mm: float = between(
        0, 5, "Extra height at the centre of a crowned gel; 0 = flat", default=0.0
    )

    @model_validator(mode="after")
    def _corners_fit(self) -> Gel:
        half = min(self.length_mm, self.width_mm) / 2
        if self.corner_radius_mm > half:
            raise FieldError(
                "corner_radius_mm",
                f"must be at most half of the shorter side ({half:g} mm)",
                "change corner_radius_mm, length_mm or width_mm",
                ("length_mm",),
            )
        return self


class LightGuide(Block):
    """The acrylic window with its two 90° bends and legs."""

    thickness_mm: float = between(
        0.5, 10, "Acrylic thickness t of window, bends and legs", default=2.5
    )
    bend_radius_ratio: Annotated[float, Field(ge=0.1, le=20)] | Literal["auto"] = Field(
        default=2.1,
        description="Inner bend radius over thickness, R/t; auto: the brightest that "
        "envelope.max_width_mm leaves room for",
    )
    leg_length_mm: float = between(0.2, 30, "Straight leg between bend and LED", default=1.0)
    side_margin_mm: float = between(0, 10, "Flat window beyond the gel on each side", default=0.5)
    end_support_mm: float = between(0.5, 10, "Window length clamped at each end", default=1.5)


class Leds(Block):
    """Two strips under the legs: one colour at -y (left in the image), one at +y, or both alike;
    and, where wanted, a third in front of the window's end face at the tip."""

    model: str = Field(
        default="LUXEON CZ",
        max_length=80,
        description="LED type: one of the library, which gives package, height and wavelengths "
        "that are left out here, or any other, for which `electronics` may give the own_ fields",
    )
    package_mm: float = between(0.3, 10, "Package edge length", default=2.0)
    height_mm: float = between(0.1, 10, "Package height", default=0.7)
    max_pitch_mm: float = between(
        0.5, 50, "Largest distance between neighbouring LEDs", default=5.0
    )
    min_gap_mm: float = between(0, 50, "Smallest gap between neighbouring packages", default=0.5)
    max_count: int = between(1, 200, "Most LEDs per side", default=12)
    placement_tolerance_mm: float = between(
        0, 2, "Placement error of an LED on its board", default=0.15
    )
    board_thickness_mm: float = between(0.2, 5, "LED board thickness", default=0.8)
    wire_diameter_mm: float = between(
        0.2, 3, "Outer diameter of the LED boards' wires, two a board", default=0.8
    )
    radiant_flux_mw: float = above(
        0, 10000, "Radiant flux of one LED at its drive current", default=10.0
    )
    light: Literal["red_green", "red_blue", "green_blue", "white"] = Field(
        default="red_green",
        description="Colours of the left and the right strip, or white light from both",
    )
    tip: Literal["none", "red", "green", "blue", "white"] = Field(
        default="none",
        description="Light of a third strip at the tip, in front of the window's end face: the "
        "colour that the sides do not have, or white with `light: white`",
    )
    red_wavelength_nm: float = between(560, 760, "Wavelength of the red LEDs", default=625.0)
    green_wavelength_nm: float = between(480, 580, "Wavelength of the green LEDs", default=525.0)
    blue_wavelength_nm: float = between(430, 490, "Wavelength of the blue LEDs", default=470.0)
    white_wavelength_nm: float = between(
        500, 620, "Mean wavelength of the white LEDs, for index and exposure", default=560.0
    )
    one_wavelength_nm: float | None = between(
        400,
        1000,
        "Wavelength of both strips, for a mono camera; those of `light` when left out",
        default=None,
    )
    emission: Literal["lambertian", "dome", "table"] = Field(
        default="lambertian",
        description="How the LED's light spreads: bare die, lens dome, or a data-sheet table",
    )
    dome_half_angle_deg: float = between(
        1, 90, "Half angle beyond which a dome sends no light", default=60.0
    )
    emission_angle_deg: tuple[float, ...] = Field(
        default=(),
        max_length=200,
        description="Angles of the table, rising from 0 to at most 90; emission: table needs it",
    )
    emission_intensity: tuple[float, ...] = Field(
        default=(), max_length=200, description="Relative intensity at each angle of the table"
    )

    @model_validator(mode="after")
    def _one_light(self) -> Leds:
        if self.one_wavelength_nm is not None and self.light != "red_green":
            raise FieldError(
                "one_wavelength_nm",
                f"both strips would have this wavelength, and light is {self.light}",
                "leave one of the two out",
                ("light",),
            )
        return self

    @model_validator(mode="after")
    def _tip_light(self) -> Leds:
        if self.tip == "none":
            return self
        if self.one_wavelength_nm is not None:
            raise FieldError(
                "tip",
                f"the sides shine at one wavelength, {self.one_wavelength_nm:g} nm, and the strip "
                f"at the tip would be {self.tip}",
                "leave tip out, or one_wavelength_nm",
                ("one_wavelength_nm",),
            )
        sides = self.light.split("_")
        free = sides if self.light == "white" else [c for c in COLOURS if c not in sides]
        if self.tip not in free:
            raise FieldError(
                "tip",
                f"must be {free[0]} where light is {self.light}; it is {self.tip}",
                f"write tip: {free[0]}, or change light",
                ("light",),
            )
        return self

    @model_validator(mode="after")
    def _table(self) -> Leds:
        if self.emission != "table":
            return self
        angles, values = self.emission_angle_deg, self.emission_intensity
        if len(angles) < 2 or len(angles) != len(values):
            raise FieldError(
                "emission_angle_deg",
                "emission: table needs as many angles as intensities, two or more of each; "
                f"there are {len(angles)} angles and {len(values)} intensities",
                "change emission_angle_deg or emission_intensity",
                ("emission_intensity", "emission"),
            )
        rising = all(a < b for a, b in itertools.pairwise(angles))
        if angles[0] != 0 or angles[-1] > 90 or not rising:
            raise FieldError(
                "emission_angle_deg",
                "must start at 0, rise, and end at 90 degrees or below",
                "correct the angles",
            )
        if min(values) < 0 or max(values) <= 0:
            raise FieldError(
                "emission_intensity", "must be >= 0 and not all zero", "correct the intensities"
            )
        return self


class Markers(Block):
    """The regular grid printed on the gel's outer surface, or `none`: a gel without markers."""

    pattern: Literal["grid", "none"] = Field(
        default="grid",
        description="A regular grid, or none: parts and light alone, without print and forces",
    )
    pitch_mm: float = between(0.2, 10, "Marker spacing", default=1.2)
    diameter_mm: float = between(
        0.05,
        5,
        "Marker diameter; without markers the size of the detail that the picture must show",
        default=0.5,
    )
    rows: int | None = between(
        5, 200, "Lattice rows along the finger; left out: fill the gel", default=None
    )
    columns: int | None = between(
        5, 200, "Lattice columns across; left out: fill the gel", default=None
    )
    edge_margin_mm: float = between(
        0, 20, "Gel left free between outermost dots and the edge", default=0.5
    )
    anchors: Literal["odd_sized", "omitted", "none"] = Field(
        default="odd_sized",
        description="How lattice anchors stand out, so that tracking cannot slip by one pitch",
    )


def without_markers(given: Any) -> Any:
    """`markers: none` as the block that it stands for; anything else as it is."""
    return {"pattern": "none"} if given == "none" else given


class Mirror(Block):
    """The front-surface fold mirror."""

    thickness_mm: float = between(0.2, 6, "Mirror thickness", default=1.0)
    border_mm: float = between(0, 5, "Mirror beyond the outermost ray on every side", default=0.8)


class Optics(Block):
    """What the camera's picture must be worth."""

    blur_per_diameter: float = above(
        0,
        2,
        "Largest blur on the gel, in marker diameters (1/3 is sharp, 1/2 the limit)",
        default=1 / 3,
    )
    min_px_per_marker: float = between(
        1, 200, "Pixels across the smallest imaged marker, at least", default=6.0
    )
    max_keystone: float = between(
        1.05, 5, "Largest ratio of far to near viewing distance", default=2.0
    )
    image_margin: float = between(0, 0.3, "Part of the half field of view kept free", default=0.015)
    clearance_mm: float = between(
        0, 5, "Free space around the view and between optical parts", default=0.3
    )


class Envelope(Block):
    """Limits the finger must keep, each optional."""

    max_thickness_mm: float | None = above(0, 300, "Thickest finger allowed", default=None)
    max_width_mm: float | None = above(0, 300, "Widest finger allowed", default=None)
    max_length_mm: float | None = above(0, 600, "Longest finger allowed", default=None)
    goal: Literal["thinnest", "shortest", "best_picture"] = Field(
        default="thinnest",
        description="What camera and mirror are arranged for, within these limits: the thinnest "
        "finger, the shortest, or the most pixels across the smallest marker",
    )
    length_worth: float = between(
        0, 10, "Thickness that a millimetre of length is worth, goal: thinnest", default=0.0
    )
    pixel_worth_mm: float = between(
        0, 10, "Thickness that a pixel more per marker is worth, goal: thinnest", default=0.0
    )

    least_yield: float | None = Field(
        default=None,
        gt=0,
        lt=1,
        description="Share of fingers that must keep every rule as they vary; the least "
        "optics.image_margin that reaches it takes the place of the given one",
    )

    @model_validator(mode="after")
    def _weights_have_their_goal(self) -> Envelope:
        for name in ("length_worth", "pixel_worth_mm"):
            if getattr(self, name) > 0 and self.goal != "thinnest":
                raise FieldError(
                    name,
                    f"is weighed against thickness, and the goal is {self.goal}",
                    "leave it out, or choose goal: thinnest",
                    ("goal",),
                )
        return self


class Design(Block):
    """All independent design variables."""

    gel: Gel = Field(description="The gel pad")
    light_guide: LightGuide = Field(default=LightGuide(), description="The curved acrylic guide")
    leds: Annotated[Leds, BeforeValidator(completed_leds)] = Field(
        default=Leds(), description="The LED strips: two, or three with one at the tip"
    )
    markers: Annotated[
        Markers, BeforeValidator(without_markers, json_schema_input_type=Markers | Literal["none"])
    ] = Field(default=Markers(), description="The printed marker grid, or none")
    mirror: Mirror = Field(default=Mirror(), description="The fold mirror")
    optics: Optics = Field(default=Optics(), description="What the picture must be worth")
    housing: Housing = Field(default=Housing(), description="Walls, fits and fasteners")
    mount: Mount = Field(default=Mount(), description="The joint to the gripper")
    envelope: Envelope = Field(default=Envelope(), description="Limits the finger must keep")

    @model_validator(mode="after")
    def _markers_fit(self) -> Design:
        if self.markers.pattern == "none":
            return self
        for axis, count, side in (
            ("rows", self.markers.rows, self.gel.length_mm),
            ("columns", self.markers.columns, self.gel.width_mm),
        ):
            if count is None:
                continue
            span = (count - 1) * self.markers.pitch_mm + self.markers.diameter_mm
            if span > side:
                raise FieldError(
                    f"markers.{axis}",
                    f"at {self.markers.pitch_mm:g} mm pitch they span {span:.2f} mm, "
                    f"more than the gel's {side:g} mm",
                    "use fewer or a smaller pitch",
                )
        if self.markers.diameter_mm >= self.markers.pitch_mm:
            raise FieldError(
                "markers.diameter_mm",
                f"{self.markers.diameter_mm:g} mm must be smaller than the pitch, "
                f"{self.markers.pitch_mm:g} mm, or else the dots merge",
                "change markers.diameter_mm or markers.pitch_mm",
                ("markers.pitch_mm",),
            )
        return self
