"""Indenters: rigid shapes that point down, each with its lowest point at its origin."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError

Size = Annotated[float, Field(gt=0, le=200)]
Offset = Annotated[float, Field(ge=-100, le=100)]
Axis = Annotated[float, Field(ge=-180, le=180)]
TipAngle = Annotated[float, Field(ge=10, le=175)]
TipRadius = Annotated[float, Field(ge=0, le=50)]


class Placed(Block):
    """Position of a shape on the tool that carries it."""

    x_mm: Offset = Field(default=0.0, description="Position on the tool, along the finger")
    y_mm: Offset = Field(default=0.0, description="Position on the tool, across the finger")
    raised_mm: float = Field(
        default=0.0, ge=0, le=50, description="Height of its lowest point above that of the tool"
    )


class Sphere(Placed):
    """A ball."""

    shape: Literal["sphere"] = Field(description="Kind of indenter")
    radius_mm: Size = Field(description="Radius of the ball")


class Cylinder(Placed):
    """A cylindrical rod that lies on its side, with flat ends."""

    shape: Literal["cylinder"] = Field(description="Kind of indenter")
    radius_mm: Size = Field(description="Radius of the rod")
    length_mm: Size = Field(description="Length of the rod")
    axis_deg: Axis = Field(default=0.0, description="Direction of the axis; 0 is along the finger")


class Ring(Placed):
    """A tube that stands on its flat end."""

    shape: Literal["ring"] = Field(description="Kind of indenter")
    outer_radius_mm: Size = Field(description="Outer radius of the ring")
    inner_radius_mm: Size = Field(description="Radius of its hole")

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
    """A punch with a flat end, which is a disc or a rectangle."""

    shape: Literal["flat_punch"] = Field(description="Kind of indenter")
    radius_mm: Size | None = Field(default=None, description="Radius of a round punch")
    length_mm: Size | None = Field(default=None, description="Length of a rectangular punch (x)")
    width_mm: Size | None = Field(default=None, description="Width of a rectangular punch (y)")

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
    """A straight edge with a rounded tip, such as a knife or the edge of a box."""

    shape: Literal["wedge"] = Field(description="Kind of indenter")
    included_angle_deg: TipAngle = Field(description="Angle between the two flanks")
    length_mm: Size = Field(description="Length of the edge")
    tip_radius_mm: TipRadius = Field(default=0.2, description="Radius of the edge")
    axis_deg: Axis = Field(default=0.0, description="Direction of the edge; 0 is along the finger")


class Cone(Placed):
    """A cone that points down and has a rounded tip."""

    shape: Literal["cone"] = Field(description="Kind of indenter")
    included_angle_deg: TipAngle = Field(description="Full angle of the cone")
    tip_radius_mm: TipRadius = Field(default=0.2, description="Radius of the tip")


class TexturedPlane(Placed):
    """A flat rectangle with a relief, such as cloth, knurling or coarse paper."""

    shape: Literal["textured_plane"] = Field(description="Kind of indenter")
    length_mm: Size = Field(description="Length along the finger")
    width_mm: Size = Field(description="Width across the finger")
    texture: Literal["ridges", "bumps", "rough"] = Field(
        default="ridges",
        description="Waves in one direction, in two directions, or random heights",
    )
    pitch_mm: float = Field(
        default=2.0,
        gt=0,
        le=100,
        description="Wavelength, or correlation length of random heights",
    )
    relief_mm: float = Field(default=0.2, ge=0, le=10, description="Height from valleys to crests")
    axis_deg: Axis = Field(
        default=0.0, description="Direction of the ridges; 0 is along the finger"
    )


class MeshFile(Placed):
    """A mesh from a file, used as a height map of its lower side."""

    file: str = Field(min_length=1, max_length=400, description="File, relative to the scene")
    scale: float = Field(default=1.0, gt=0, le=1e4, description="Millimetres per unit of the file")
    down: Literal["x", "-x", "y", "-y", "z", "-z"] = Field(
        default="-z", description="Direction in the file that points into the gel"
    )
    resolution_mm: float = Field(
        default=0.05, gt=0, le=5, description="Cell size of the height map"
    )


class Mesh(MeshFile):
    """A mesh from an STL, OBJ or PLY file, used as a height map of its lower side."""

    shape: Literal["mesh"] = Field(description="Kind of indenter")


class Stl(MeshFile):
    """The earlier name of `mesh`."""

    shape: Literal["stl"] = Field(description="Kind of indenter")


Indenter = Annotated[
    Sphere | Cylinder | Ring | FlatPunch | Wedge | Cone | TexturedPlane | Mesh | Stl,
    Field(discriminator="shape"),
]
