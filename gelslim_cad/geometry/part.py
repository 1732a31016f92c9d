"""A part of the finger or of its tooling: a named solid and how it is made."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    import cadquery as cq

Process = Literal["print", "laser", "bend", "countersink", "cast", "buy", "pcb", "cut"]
"""How a part is made: `print` gives STL and 3MF, `laser` and `cut` a DXF outline; `bend` and
`countersink` start from a laser-cut blank, which is a part of its own."""


@dataclass(frozen=True)
class Part:
    """One physical part. A notebook shows it as a picture where VTK is installed.

    Attributes:
        name: Name, which is also that of its files.
        solid: One valid solid in mm in the sensor frame (origin at the centre of the gel's outer
            surface, x towards the tip, y across, z out of the gel), where it is assembled;
            tooling (`in_assembly=False`) has a frame of its own.
        material: Material, in words.
        process: How it is made.
        colour: sRGB colour with opacity, each from 0 to 1.
        quantity: How many are needed.
        in_assembly: Whether it belongs to the finger; tooling does not.
        explode_mm: Displacement of the part in the exploded view. The z that a maker gives tells
            only direction and order; `gelslim_cad/solids/explode.py` finds the distance.
        print_rotation_deg: Rotations about x, then y, then z that lay the part flat for printing.
        note: Advice for the maker, for the bill of materials.
        printed: The solid as it is made where assembly bends it, such as a spring; None where that
            is `solid`.
        density_g_cm3: Density where it is not that of the material, as of a part of one's own.
        tags: Groups that the part belongs to, such as `tooling`, `mould` and `fastener`.
    """

    name: str
    solid: cq.Shape
    material: str
    process: Process
    colour: tuple[float, float, float, float]
    quantity: int = 1
    in_assembly: bool = True
    explode_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    print_rotation_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    note: str = ""
    printed: cq.Shape | None = None
    density_g_cm3: float | None = None
    tags: frozenset[str] = field(default_factory=frozenset)

    def as_made(self) -> Part:
        """The part before it is assembled."""
        return self if self.printed is None else replace(self, solid=self.printed, printed=None)

    def _repr_png_(self) -> bytes | None:
        """Picture for a notebook; None, which shows the text instead, where none can be drawn."""
        from gelslim_cad.pictures.finger_pictures import picture_whole
        from gelslim_cad.pictures.window import PictureError

        # On a copy: a tessellation stays on the shape and would change later exports.
        vertices, faces = self.solid.copy().tessellate(0.05, math.radians(12))
        points = np.array([vertex.toTuple() for vertex in vertices])
        mesh = (self.name, points, np.array(faces), self.colour, (0.0, 0.0, 0.0))
        try:
            return picture_whole([mesh])
        except PictureError:
            return None
