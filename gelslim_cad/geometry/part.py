"""A part of the finger or of its tooling: a named solid and how it is made."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import cadquery as cq

Process = Literal["print", "laser", "bend", "cast", "buy", "pcb", "cut"]
"""How a part comes to be: `print` gives STL and 3MF, `laser` and `cut` a DXF outline; `bend` is
formed from a laser-cut blank, which is a part of its own."""


@dataclass(frozen=True)
class Part:
    """One physical part.

    `solid` is a single valid solid in mm in the sensor frame (origin at the centre of the
    gel's outer surface, x towards the tip, y across, z out of the gel), in its assembled place;
    tooling (`in_assembly=False`) lies in its own frame.
    """

    name: str
    solid: cq.Shape
    material: str
    process: Process
    colour: tuple[float, float, float, float]
    quantity: int = 1
    in_assembly: bool = True
    explode_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the exploded view moves the part."""
    print_rotation_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Rotations about x, then y, then z that lay the part flat for printing."""
    note: str = ""
    """What a maker should know, for the bill of materials."""
    tags: frozenset[str] = field(default_factory=frozenset)
