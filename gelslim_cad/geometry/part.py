"""A part of the finger or of its tooling: a named solid and how it is made."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    import cadquery as cq

Process = Literal["print", "laser", "bend", "cast", "buy", "pcb", "cut"]
"""How a part is made: `print` gives STL and 3MF, `laser` and `cut` a DXF outline; `bend` is
formed from a laser-cut blank, which is a part of its own."""


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
        explode_mm: Displacement of the part in the exploded view.
        print_rotation_deg: Rotations about x, then y, then z that lay the part flat for printing.
        note: Advice for the maker, for the bill of materials.
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
    tags: frozenset[str] = field(default_factory=frozenset)

    def _repr_png_(self) -> bytes | None:
        """Picture for a notebook; None, which shows the text instead, where none can be drawn."""
        from gelslim_cad.pictures.finger_pictures import PictureError, picture_whole

        # On a copy: a tessellation stays on the shape and would change later exports.
        vertices, faces = self.solid.copy().tessellate(0.05, math.radians(12))
        points = np.array([vertex.toTuple() for vertex in vertices])
        mesh = (self.name, points, np.array(faces), self.colour, (0.0, 0.0, 0.0))
        try:
            return picture_whole([mesh])
        except PictureError:
            return None
