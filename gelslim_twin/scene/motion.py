"""How the tool moves: waypoints that each add one movement, or a table of poses."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError

MAX_POSES = 20_000

Lateral = Annotated[float, Field(ge=-100, le=100)]
Angle = Annotated[float, Field(ge=-180, le=180)]


class Timed(Block):
    """How finely and how long."""

    steps: int = Field(default=10, ge=1, le=5000, description="Poses this movement is cut into")
    duration_s: float = Field(default=0.5, gt=0, le=3600, description="Time it takes")


class Press(Timed):
    """Straight down or up to a depth below the undeformed gel surface."""

    move: Literal["press"] = Field(description="Kind of movement")
    depth_mm: float = Field(
        ge=-50, le=20, description="Depth at the end; negative is above the gel"
    )


class Shear(Timed):
    """Sideways by so little that the contact mostly sticks."""

    move: Literal["shear"] = Field(description="Kind of movement")
    x_mm: Annotated[float, Field(ge=-5, le=5)] = Field(default=0.0, description="Along the finger")
    y_mm: Annotated[float, Field(ge=-5, le=5)] = Field(default=0.0, description="Across the finger")


class Slide(Timed):
    """Sideways over a distance; the contact slips once the friction limit is reached."""

    move: Literal["slide"] = Field(description="Kind of movement")
    x_mm: Lateral = Field(default=0.0, description="Along the finger")
    y_mm: Lateral = Field(default=0.0, description="Across the finger")


class Twist(Timed):
    """Turned about the gel's normal through the tool's lowest point."""

    move: Literal["twist"] = Field(description="Kind of movement")
    angle_deg: Angle = Field(description="Anticlockwise seen from outside")


class Tilt(Timed):
    """Tipped about an axis in the gel's surface through the tool's lowest point."""

    move: Literal["tilt"] = Field(description="Kind of movement")
    about: Literal["x", "y"] = Field(description="Axis")
    angle_deg: Annotated[float, Field(ge=-45, le=45)] = Field(description="Right-handed")


class Hold(Timed):
    """Stay: the gel relaxes."""

    move: Literal["hold"] = Field(description="Kind of movement")


class Release(Timed):
    """Straight up until the tool is clear of the gel."""

    move: Literal["release"] = Field(description="Kind of movement")
    clearance_mm: float = Field(
        default=0.2, ge=0, le=50, description="Height above the gel at the end"
    )


Waypoint = Annotated[
    Press | Shear | Slide | Twist | Tilt | Hold | Release, Field(discriminator="move")
]


class Motion(Block):
    """Where the tool starts, just touching, and what it does; or a table that says it all."""

    start_x_mm: Lateral = Field(default=0.0, description="Start, along the finger")
    start_y_mm: Lateral = Field(default=0.0, description="Start, across the finger")
    waypoints: tuple[Waypoint, ...] | None = Field(
        default=None, min_length=1, max_length=500, description="Movements, one after the other"
    )
    csv: str | None = Field(
        default=None,
        min_length=1,
        max_length=400,
        description="Table of poses instead, relative to the scene",
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
        if self.csv is not None and (self.start_x_mm or self.start_y_mm):
            name = "start_x_mm" if self.start_x_mm else "start_y_mm"
            raise FieldError(name, "the table gives the place itself", "delete the line")
        count = 1 + sum(w.steps for w in self.waypoints or ())
        if count > MAX_POSES:
            raise FieldError(
                "waypoints", f"make {count} poses, the limit is {MAX_POSES}", "use fewer steps"
            )
        return self
