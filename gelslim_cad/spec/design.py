"""The designer's independent variables; the dependent ones follow and never stand here."""

from __future__ import annotations

import itertools
from typing import Annotated, Literal

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError


class Gel(Block):
    """The soft pad."""

    length_mm: float = Field(ge=5, le=120, description="Gel size along the finger")
    width_mm: float = Field(ge=5, le=120, description="Gel size across the finger")
    thickness_mm: float = Field(
        default=2.0, gt=0, ge=0.3, le=15, description="Gel thickness at its edge"
    )
    corner_radius_mm: float = Field(
        default=2.0, ge=0, le=60, description="Corner radius of the gel outline"
    )
    crown_height_mm: float = Field(
        default=0.0, ge=0, le=5, description="Extra height at the centre of a crowned gel; 0 = flat"
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

    thickness_mm: float = Field(
        default=2.5, ge=0.5, le=10, description="Acrylic thickness t of window, bends and legs"
    )
    bend_radius_ratio: Annotated[float, Field(ge=0.1, le=20)] | Literal["auto"] = Field(
        default=2.1,
        description="Inner bend radius over thickness, R/t; auto: the brightest that "
        "envelope.max_width_mm leaves room for",
    )
    leg_length_mm: float = Field(
        default=1.0, ge=0.2, le=30, description="Straight leg between bend and LED"
    )
    side_margin_mm: float = Field(
        default=0.5, ge=0, le=10, description="Flat window beyond the gel on each side"
    )
    end_support_mm: float = Field(
        default=1.5, ge=0.5, le=10, description="Window length clamped at each end"
    )


class Leds(Block):
    """Two strips under the legs: red at -y (left in the image), green at +y."""

    model: str = Field(default="LUXEON CZ", max_length=80, description="LED type, for the BOM")
    package_mm: float = Field(default=2.0, ge=0.3, le=10, description="Package edge length")
    height_mm: float = Field(default=0.7, ge=0.1, le=10, description="Package height")
    max_pitch_mm: float = Field(
        default=5.0, ge=0.5, le=50, description="Largest distance between neighbouring LEDs"
    )
    min_gap_mm: float = Field(
        default=0.5, ge=0, le=50, description="Smallest gap between neighbouring packages"
    )
    max_count: int = Field(default=12, ge=1, le=200, description="Most LEDs per side")
    placement_tolerance_mm: float = Field(
        default=0.15, ge=0, le=2, description="Placement error of an LED on its board"
    )
    board_thickness_mm: float = Field(default=0.8, ge=0.2, le=5, description="LED board thickness")
    radiant_flux_mw: float = Field(
        default=20.0, gt=0, le=10000, description="Radiant flux of one LED at its drive current"
    )
    red_wavelength_nm: float = Field(
        default=625.0, ge=560, le=760, description="Wavelength of the red LEDs"
    )
    green_wavelength_nm: float = Field(
        default=525.0, ge=480, le=580, description="Wavelength of the green LEDs"
    )
    emission: Literal["lambertian", "dome", "table"] = Field(
        default="lambertian",
        description="How the LED's light spreads: bare die, lens dome, or a data-sheet table",
    )
    dome_half_angle_deg: float = Field(
        default=60.0, ge=1, le=90, description="Half angle beyond which a dome sends no light"
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
    """The regular grid printed on the gel's outer surface."""

    pitch_mm: float = Field(default=1.2, ge=0.2, le=10, description="Marker spacing")
    diameter_mm: float = Field(default=0.5, ge=0.05, le=5, description="Marker diameter")
    rows: int | None = Field(
        default=None,
        ge=5,
        le=200,
        description="Lattice rows along the finger; left out: fill the gel",
    )
    columns: int | None = Field(
        default=None, ge=5, le=200, description="Lattice columns across; left out: fill the gel"
    )
    edge_margin_mm: float = Field(
        default=0.5, ge=0, le=20, description="Gel left free between outermost dots and the edge"
    )
    anchors: Literal["odd_sized", "omitted", "none"] = Field(
        default="odd_sized",
        description="How lattice anchors stand out, so that tracking cannot slip by one pitch",
    )


class Mirror(Block):
    """The front-surface fold mirror."""

    thickness_mm: float = Field(default=1.0, ge=0.2, le=6, description="Mirror thickness")
    border_mm: float = Field(
        default=0.8, ge=0, le=5, description="Mirror beyond the outermost ray on every side"
    )


class Optics(Block):
    """What the camera's picture must be worth."""

    blur_per_diameter: float = Field(
        default=1 / 3,
        gt=0,
        le=2,
        description="Largest blur on the gel, in marker diameters (1/3 is sharp, 1/2 the limit)",
    )
    min_px_per_marker: float = Field(
        default=6.0, ge=1, le=200, description="Pixels across the smallest imaged marker, at least"
    )
    max_keystone: float = Field(
        default=2.0, ge=1.05, le=5, description="Largest ratio of far to near viewing distance"
    )
    image_margin: float = Field(
        default=0.015, ge=0, le=0.3, description="Part of the half field of view kept free"
    )
    clearance_mm: float = Field(
        default=0.3, ge=0, le=5, description="Free space around the view and between optical parts"
    )


class Housing(Block):
    """Walls, fits and fasteners of the printed parts."""

    side_wall_mm: float = Field(default=1.5, ge=0.4, le=10, description="Side wall thickness")
    back_wall_mm: float = Field(default=1.2, ge=0.4, le=10, description="Back cover thickness")
    tip_wall_mm: float = Field(
        default=5.0, ge=2, le=30, description="Length of the tip block that holds the bezel screws"
    )
    baffle_mm: float = Field(
        default=0.8, ge=0.3, le=5, description="Light baffle between LED channel and camera view"
    )
    ledge_mm: float = Field(
        default=1.5, ge=0.5, le=10, description="Thickness of the ledge that carries the window"
    )
    fit_clearance_mm: float = Field(
        default=0.2, ge=0.02, le=2, description="Gap between parts that slide into each other"
    )
    gel_proud_mm: float = Field(
        default=0.6, ge=0, le=10, description="How far the gel stands above the bezel"
    )
    shim_thickness_mm: float = Field(
        default=1.0, ge=0.2, le=5, description="Free thickness of the elastic shims"
    )
    precompression_mm: float = Field(
        default=0.45, ge=0, le=4, description="How much the bezel compresses the optical stack"
    )
    screw: Literal["M1.6", "M2", "M2.5"] = Field(
        default="M2", description="Countersunk screw that holds bezel and cover"
    )
    corner_radius_mm: float = Field(
        default=3.0, ge=0, le=20, description="Corner radius of the finger seen from above"
    )


class Mount(Block):
    """How the finger sits on the gripper: tongues held by two cross bolts."""

    gripper: str = Field(default="generic", max_length=80, description="Gripper, for the BOM")
    bolt: Literal["M2", "M2.5", "M3", "M4"] = Field(default="M3", description="Cross bolt")
    tongue_length_mm: float = Field(
        default=10.0, ge=5, le=60, description="Tongue length inside the finger"
    )
    tongue_thickness_mm: float = Field(
        default=5.0, ge=2, le=30, description="Tongue thickness across the finger's thickness"
    )
    flange_thickness_mm: float = Field(
        default=5.0, ge=2, le=30, description="Thickness of the flange against the gripper"
    )
    flange_bolt: Literal["M3", "M4", "M5", "M6"] = Field(
        default="M4", description="Bolt from flange to gripper"
    )
    flange_bolt_spacing_mm: float = Field(
        default=20.0, ge=5, le=200, description="Distance of the two gripper bolts"
    )


class Envelope(Block):
    """Limits the finger must keep, each optional."""

    max_thickness_mm: float | None = Field(
        default=None, gt=0, le=300, description="Thickest finger allowed"
    )
    max_width_mm: float | None = Field(
        default=None, gt=0, le=300, description="Widest finger allowed"
    )
    max_length_mm: float | None = Field(
        default=None, gt=0, le=600, description="Longest finger allowed"
    )


class Design(Block):
    """All independent design variables."""

    gel: Gel = Field(description="The gel pad")
    light_guide: LightGuide = Field(default=LightGuide(), description="The curved acrylic guide")
    leds: Leds = Field(default=Leds(), description="The two LED strips")
    markers: Markers = Field(default=Markers(), description="The printed marker grid")
    mirror: Mirror = Field(default=Mirror(), description="The fold mirror")
    optics: Optics = Field(default=Optics(), description="What the picture must be worth")
    housing: Housing = Field(default=Housing(), description="Walls, fits and fasteners")
    mount: Mount = Field(default=Mount(), description="The joint to the gripper")
    envelope: Envelope = Field(default=Envelope(), description="Limits the finger must keep")

    @model_validator(mode="after")
    def _markers_fit(self) -> Design:
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
