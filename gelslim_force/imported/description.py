"""The description of a sensor that was not generated here: `format: gelslim-sensor/1`."""

from __future__ import annotations

import math
import os
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block, require_folder_name
from gelslim_core.yaml.errors import FieldError
from gelslim_core.yaml.reader import Loaded, read_model

FORMAT = "gelslim-sensor/1"
Direction = Literal["right", "down", "left", "up"]
"""Directions in the picture."""
Length = Annotated[float, Field(gt=0, le=500)]
Pair = tuple[float, float]


class Gel(Block):
    """The gel: a flat pad that is bonded to a stiff plate; x along its length, y across."""

    length_mm: Length = Field(description="Length along x")
    width_mm: Length = Field(description="Width along y")
    thickness_mm: float = Field(gt=0, le=50, description="Thickness")
    corner_radius_mm: float = Field(default=0.0, ge=0, le=250, description="Radius of the corners")
    thickness_tolerance_mm: float = Field(
        default=0.2, ge=0, le=10, description="Standard deviation of the thickness"
    )
    youngs_modulus_mpa: float = Field(
        default=0.2, gt=0, le=20, description="Young's modulus; forces are proportional to it"
    )
    youngs_modulus_tolerance_ratio: float = Field(
        default=0.5,
        ge=0,
        le=1,
        description="Standard deviation of Young's modulus, as a part of it",
    )
    poissons_ratio: float = Field(default=0.48, ge=0, lt=0.5, description="Poisson's ratio")
    poissons_ratio_tolerance: float = Field(
        default=0.01, ge=0, le=0.2, description="Standard deviation of Poisson's ratio"
    )
    density_kg_m3: float = Field(default=1000.0, gt=100, le=5000, description="Density")
    refractive_index: float = Field(default=1.41, ge=1, le=2, description="Refractive index")

    @model_validator(mode="after")
    def _round_corners(self) -> Gel:
        most = min(self.length_mm, self.width_mm) / 2
        if self.corner_radius_mm > most:
            raise FieldError(
                "corner_radius_mm", f"must be <= {most:g} mm, half the shorter side", "correct it"
            )
        return self


class Markers(Block):
    """The dots: a lattice, whose pitch gives the scale where nothing else does."""

    pitch_mm: Length | None = Field(
        default=None, description="Distance of neighbouring dots; along x where it differs along y"
    )
    pitch_across_mm: Length | None = Field(
        default=None, description="Distance of neighbouring dots along y where it differs"
    )
    diameters_px: tuple[float, float] | None = Field(
        default=None,
        description="Smallest and largest diameter in the picture; by default estimated",
    )

    @model_validator(mode="after")
    def _ordered(self) -> Markers:
        if self.pitch_across_mm is not None and self.pitch_mm is None:
            raise FieldError("pitch_across_mm", "is that along y", "give pitch_mm along x too")
        sizes = self.diameters_px
        if sizes is not None and not 1 <= sizes[0] < sizes[1] <= 400:
            raise FieldError(
                "diameters_px", "must be two sizes, 1 <= smallest < largest <= 400", ""
            )
        return self


class PointPair(Block):
    """A point of the gel's surface and where the picture shows it."""

    gel_mm: Pair = Field(description="x and y on the gel")
    picture_px: Pair = Field(
        description="Column and row in the picture, the first pixel's centre at 0, 0"
    )


class Pinhole(Block):
    """Where the camera is; over a mirror, its mirror image."""

    position_mm: tuple[float, float, float] = Field(
        description="x, y and z of the pinhole; below the gel z is negative"
    )
    looks_at_mm: Pair = Field(
        default=(0.0, 0.0), description="Point of the gel in the middle of the picture"
    )


class View(Block):
    """What the picture shows: by points, a homography, the pinhole, or by the pitch alone."""

    reference: str = Field(
        min_length=1,
        max_length=400,
        description="Picture without contact, or a folder of several to average",
    )
    x_points: Direction = Field(
        default="right", description="Where x points in the picture, more or less"
    )
    mirrored: bool = Field(
        default=False,
        description="The picture shows the gel as seen from outside: over one mirror, or flipped",
    )
    points: tuple[PointPair, ...] | None = Field(
        default=None, min_length=4, max_length=500, description="At least four points of the gel"
    )
    homography: tuple[tuple[float, float, float], ...] | None = Field(
        default=None,
        min_length=3,
        max_length=3,
        description="Three rows: from x and y in mm to column and row in px",
    )
    pinhole: Pinhole | None = Field(default=None, description="Place of the camera")
    gel_middle_px: Pair | None = Field(
        default=None,
        description="Where the middle of the gel is; by default that of the dots",
    )
    scale_tolerance_ratio: float = Field(
        default=0.01, ge=0, le=0.3, description="Standard deviation of the scale, as a part of it"
    )

    @model_validator(mode="after")
    def _one_way(self) -> View:
        ways = [w for w in ("points", "homography", "pinhole") if getattr(self, w) is not None]
        if len(ways) > 1:
            raise FieldError(ways[1], f"says the same as {ways[0]}", "leave one of them out")
        if ways and self.gel_middle_px is not None:
            raise FieldError("gel_middle_px", f"follows from {ways[0]}", "leave it out")
        return self


class Lens(Block):
    """The lens: what is not given is assumed, and what follows from it is uncertain."""

    focal_px: float | None = Field(
        default=None, gt=10, le=100_000, description="Focal length over the pixel pitch"
    )
    field_of_view_deg: float | None = Field(
        default=None, ge=2, le=170, description="Angle across the width of the picture"
    )
    intrinsics: str | None = Field(
        default=None, description="Lens as measured: YAML file of ROS or OpenCV"
    )
    focal_tolerance_ratio: float = Field(
        default=0.03, gt=0, le=0.5, description="Standard deviation of a focal length that is given"
    )

    @model_validator(mode="after")
    def _one_way(self) -> Lens:
        names = ("focal_px", "field_of_view_deg", "intrinsics")
        ways = [w for w in names if getattr(self, w) is not None]
        if len(ways) > 1:
            raise FieldError(ways[1], f"says the same as {ways[0]}", "leave one of them out")
        return self

    def focal_of(self, width_px: int) -> float | None:
        """Focal length in px for pictures of this width; None where it is not given."""
        if self.field_of_view_deg is not None:
            return width_px / 2 / math.tan(math.radians(self.field_of_view_deg) / 2)
        return self.focal_px


class Window(Block):
    """A clear plate between camera and gel."""

    thickness_mm: float = Field(ge=0, le=50, description="Thickness")
    index: float = Field(default=1.49, ge=1, le=2.5, description="Refractive index")


class SensorDescription(Block):
    """A marker sensor: its gel, its dots, and what its picture shows."""

    starting_point: ClassVar[str] = "start from `gelslim import-sensor --new sensor.yaml`"

    format: Literal["gelslim-sensor/1"] = Field(description="Kind and version of this file")
    name: str = Field(
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_.\-]{0,62}$", description="Name, for files and folders"
    )
    gel: Gel
    markers: Markers = Field(default_factory=Markers)
    view: View
    lens: Lens = Field(default_factory=Lens)
    windows: tuple[Window, ...] = Field(
        default=(), max_length=8, description="Plates from the camera to the gel; none if unknown"
    )

    @model_validator(mode="after")
    def _scaled(self) -> SensorDescription:
        require_folder_name("name", self.name)
        view, lens = self.view, self.lens
        by_place = view.points or view.homography or view.pinhole
        if not by_place and self.markers.pitch_mm is None:
            raise FieldError(
                "markers.pitch_mm",
                "missing: nothing says how large the picture shows the gel",
                "measure over many dots and divide, or give view.points",
            )
        known = lens.focal_px or lens.field_of_view_deg or lens.intrinsics
        if view.pinhole is not None and not known:
            raise FieldError(
                "lens.focal_px",
                "missing: a pinhole gives a scale only with the focal length",
                "give focal_px, field_of_view_deg or intrinsics",
            )
        return self


def read_description(path: str | os.PathLike[str]) -> Loaded[SensorDescription]:
    """Read the description of a sensor.

    Args:
        path: YAML file.

    Returns:
        The description with the places of its fields in the file.

    Raises:
        InputError: The file cannot be read or breaks a rule; all problems are listed.
    """
    return read_model(path, SensorDescription)
