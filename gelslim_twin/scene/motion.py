"""Motion of the tool: waypoints that each add one movement, or a table of poses."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError

MAX_POSES = 20_000

Lateral = Annotated[float, Field(ge=-100, le=100)]
Shearing = Annotated[float, Field(ge=-5, le=5)]
Angle = Annotated[float, Field(ge=-180, le=180)]
Tilting = Annotated[float, Field(ge=-45, le=45)]


class Timed(Block):
    """Number of poses and duration of a movement."""

    steps: int = Field(default=10, ge=1, le=5000, description="Number of poses of this movement")
    duration_s: float = Field(default=0.5, gt=0, le=3600, description="Duration of this movement")


class Press(Timed):
    """The tool moves straight down or up to a depth below the undeformed surface of the gel."""

    move: Literal["press"] = Field(description="Kind of movement")
    depth_mm: float = Field(
        ge=-50, le=20, description="Depth at the end; negative values are above the gel"
    )


class Shear(Timed):
    """The tool moves sideways by so little that most of the contact sticks."""

    move: Literal["shear"] = Field(description="Kind of movement")
    x_mm: Shearing = Field(default=0.0, description="Distance along the finger")
    y_mm: Shearing = Field(default=0.0, description="Distance across the finger")


class Slide(Timed):
    """The tool moves sideways, and the contact slips once the limit of friction is reached."""

    move: Literal["slide"] = Field(description="Kind of movement")
    x_mm: Lateral = Field(default=0.0, description="Distance along the finger")
    y_mm: Lateral = Field(default=0.0, description="Distance across the finger")


class Twist(Timed):
    """The tool turns about the normal of the gel through its lowest point."""

    move: Literal["twist"] = Field(description="Kind of movement")
    angle_deg: Angle = Field(description="Angle, anticlockwise as seen from outside the finger")


class Tilt(Timed):
    """The tool tilts about an axis in the surface of the gel through its lowest point."""

    move: Literal["tilt"] = Field(description="Kind of movement")
    about: Literal["x", "y"] = Field(description="Axis of the tilt")
    angle_deg: float = Field(ge=-45, le=45, description="Right-handed angle of the tilt")


class Roll(Timed):
    """The tool rolls on the gel like a wheel about an axis in the surface, without slipping."""

    move: Literal["roll"] = Field(description="Kind of movement")
    about: Literal["x", "y"] = Field(description="Direction of the wheel's axle")
    angle_deg: float = Field(ge=-90, le=90, description="Right-handed angle of the roll")
    radius_mm: float = Field(
        gt=0, le=200, description="Height of the axle above the lowest point of the upright tool"
    )


class Hold(Timed):
    """The tool stays where it is while the gel relaxes."""

    move: Literal["hold"] = Field(description="Kind of movement")


class Release(Timed):
    """The tool moves straight up until it is clear of the gel."""

    move: Literal["release"] = Field(description="Kind of movement")
    clearance_mm: float = Field(
        default=0.2, ge=0, le=50, description="Height above the gel at the end"
    )


Waypoint = Annotated[
    Press | Shear | Slide | Twist | Tilt | Roll | Hold | Release, Field(discriminator="move")
]


START = ("start_x_mm", "start_y_mm", "start_twist_deg", "start_tilt_x_deg", "start_tilt_y_deg")


class Motion(Block):
    """Motion of the tool by waypoints, from a start where it just touches, or by a table."""

    start_x_mm: Lateral = Field(default=0.0, description="Position of the start, along the finger")
    start_y_mm: Lateral = Field(default=0.0, description="Position of the start, across the finger")
    start_twist_deg: Angle = Field(
        default=0.0, description="Turn about the normal of the gel at the start"
    )
    start_tilt_x_deg: Tilting = Field(default=0.0, description="Tilt about x at the start")
    start_tilt_y_deg: Tilting = Field(default=0.0, description="Tilt about y at the start")
    waypoints: tuple[Waypoint, ...] | None = Field(
        default=None, min_length=1, max_length=500, description="Movements, one after the other"
    )
    csv: str | None = Field(
        default=None,
        min_length=1,
        max_length=400,
        description="Path of a table of poses instead, relative to the scene",
    )

    @model_validator(mode="after")
    def _one(self) -> Motion:
        if self.waypoints is not None and self.csv is not None:
            raise FieldError("csv", "given beside waypoints", "delete one of the two")
        if self.waypoints is None and self.csv is None:
            raise FieldError(
                "",
                "has neither waypoints nor csv",
                "add `waypoints:` with a line `- move: press` below",
            )
        given = [name for name in START if getattr(self, name)]
        if self.csv is not None and given:
            raise FieldError(given[0], "the table gives the place itself", "delete the line")
        count = 1 + sum(w.steps for w in self.waypoints or ())
        if count > MAX_POSES:
            raise FieldError(
                "waypoints", f"make {count} poses, the limit is {MAX_POSES}", "use fewer steps"
            )
        return self
