"""What presses on the gel: rigid shapes, each pointing down with its lowest point at its origin."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError

Size = Annotated[float, Field(gt=0, le=200)]
Offset = Annotated[float, Field(ge=-100, le=100)]


class Placed(Block):
    """Where a shape sits on the tool that carries it."""

    x_mm: Offset = Field(default=0.0, description="Place on the tool, along the finger")
    y_mm: Offset = Field(default=0.0, description="Place on the tool, across the finger")
    raised_mm: float = Field(
        default=0.0, ge=0, le=50, description="How far its lowest point lies above the tool's"
    )


class Sphere(Placed):
    """A ball."""

    shape: Literal["sphere"] = Field(description="Kind of indenter")
    radius_mm: Size = Field(description="Radius of the ball")


class Cylinder(Placed):
    """A rod lying on its side, cut off square."""

    shape: Literal["cylinder"] = Field(description="Kind of indenter")
    radius_mm: Size = Field(description="Radius of the rod")
    length_mm: Size = Field(description="Length of the rod")
    axis_deg: float = Field(
        default=0.0, ge=-180, le=180, description="Direction of the axis, 0 along the finger"
    )


class Ring(Placed):
    """A flat ring standing on its end: a tube."""

    shape: Literal["ring"] = Field(description="Kind of indenter")
    outer_radius_mm: Size = Field(description="Outer radius")
    inner_radius_mm: Size = Field(description="Radius of the hole")

    @model_validator(mode="after")
    def _hole(self) -> Ring:
        if self.inner_radius_mm >= self.outer_radius_mm:
            raise FieldError(
                "inner_radius_mm",
                f"must be below outer_radius_mm ({self.outer_radius_mm:g})",
                "make the hole smaller",
            )
        return self


class FlatPunch(Placed):
    """A flat-ended prism: round, or a rectangle with rounded corners."""

    shape: Literal["flat_punch"] = Field(description="Kind of indenter")
    radius_mm: Size | None = Field(default=None, description="Radius of a round punch")
    length_mm: Size | None = Field(default=None, description="Length of a rectangular punch, x")
    width_mm: Size | None = Field(default=None, description="Width of a rectangular punch, y")

    @model_validator(mode="after")
    def _one_outline(self) -> FlatPunch:
        sides = (self.length_mm, self.width_mm)
        if self.radius_mm is None and None in sides:
            raise FieldError(
                "radius_mm" if sides == (None, None) else "length_mm",
                "the punch has no outline",
                "give radius_mm for a round one, length_mm and width_mm for a rectangle",
            )
        if self.radius_mm is not None and sides != (None, None):
            raise FieldError("radius_mm", "given beside length_mm or width_mm", "delete one kind")
        return self


class Wedge(Placed):
    """A straight edge with a rounded tip: a knife, the corner of a box."""

    shape: Literal["wedge"] = Field(description="Kind of indenter")
    included_angle_deg: float = Field(ge=10, le=175, description="Angle between the two flanks")
    length_mm: Size = Field(description="Length of the edge")
    tip_radius_mm: float = Field(default=0.2, ge=0, le=50, description="Radius of the edge")
    axis_deg: float = Field(
        default=0.0, ge=-180, le=180, description="Direction of the edge, 0 along the finger"
    )


class Cone(Placed):
    """A cone pointing down with a rounded tip."""

    shape: Literal["cone"] = Field(description="Kind of indenter")
    included_angle_deg: float = Field(ge=10, le=175, description="Full angle of the cone")
    tip_radius_mm: float = Field(default=0.2, ge=0, le=50, description="Radius of the tip")


class TexturedPlane(Placed):
    """A flat rectangle with a relief: cloth, knurling, coarse paper."""

    shape: Literal["textured_plane"] = Field(description="Kind of indenter")
    length_mm: Size = Field(description="Length along the finger")
    width_mm: Size = Field(description="Width across the finger")
    texture: Literal["ridges", "bumps", "rough"] = Field(
        default="ridges", description="Waves one way, waves both ways, or random heights"
    )
    pitch_mm: float = Field(
        default=2.0, gt=0, le=100, description="Wavelength; of rough ones the correlation length"
    )
    relief_mm: float = Field(default=0.2, ge=0, le=10, description="Height from valley to crest")
    axis_deg: float = Field(
        default=0.0, ge=-180, le=180, description="Direction of the ridges, 0 along the finger"
    )


class Stl(Placed):
    """A mesh from an STL file, used through its height map seen from below."""

    shape: Literal["stl"] = Field(description="Kind of indenter")
    file: str = Field(min_length=1, max_length=400, description="STL file, relative to the scene")
    scale: float = Field(default=1.0, gt=0, le=1e4, description="Millimetres per unit of the file")
    down: Literal["x", "-x", "y", "-y", "z", "-z"] = Field(
        default="-z", description="Direction in the file that points into the gel"
    )
    resolution_mm: float = Field(
        default=0.05, gt=0, le=5, description="Cell size of the height map"
    )


Indenter = Annotated[
    Sphere | Cylinder | Ring | FlatPunch | Wedge | Cone | TexturedPlane | Stl,
    Field(discriminator="shape"),
]
