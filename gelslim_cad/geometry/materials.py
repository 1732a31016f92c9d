"""Materials of the parts: density and strength, with the source of each figure.

One table serves the masses of the bill of materials, the robot models and the rules on strength.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gelslim_cad.geometry.part import Part

PRINTED = {"sla": "tough resin", "fdm": "PETG", "sls": "PA12"}
"""Material of a printed part by process."""
SAFETY = 2.0
"""Of a part's strength only this share is used: a gripper strikes, and prints vary."""
GEL_FRICTION = 0.5
"""Of the gel's coat on plastic, dry; paints and fabrics reach 0.4 to 1. Assumed."""


@dataclass(frozen=True)
class MaterialData:
    """Figures of a material.

    Attributes:
        density_g_cm3: Density.
        source: Where the figures come from.
        strength_mpa: Strength in tension; of a print across its layers, the weakest direction.
            None where no rule needs it.
        assumed: Whether no sheet states the figures.
    """

    density_g_cm3: float
    source: str
    strength_mpa: float | None = None
    assumed: bool = False


MATERIALS = {
    "tough resin": MaterialData(
        1.15, "Formlabs, data sheet of Tough 2000: 46 MPa after curing, in all directions", 46.0
    ),
    "PETG": MaterialData(
        1.27, "Prusament PETG, data sheet: 47 MPa flat; half of it across the layers", 23.5, True
    ),
    "PA12": MaterialData(0.93, "EOS, data sheet of PA 2200: 0.93 g/cm³, 42 MPa upright", 42.0),
    "cast acrylic": MaterialData(1.19, "Roehm, data sheet of Plexiglas GS: 1.19 g/cm³"),
    "front-surface mirror": MaterialData(2.5, "soda-lime glass"),
    "silicone sheet": MaterialData(1.15, "solid silicone of 40 to 60 Shore A"),
    "steel": MaterialData(7.85, "carbon steel of class 8.8", 640.0),
    "aluminium": MaterialData(2.66, "EN AW-5754, EN 573-3 and makers' sheets: 2.66 g/cm³"),
    "stainless steel": MaterialData(7.9, "1.4301, EN 10088-1: 7.9 g/cm³"),
    "flat cable": MaterialData(1.7, "polyimide and copper; weigh your own", assumed=True),
    "round cable": MaterialData(2.0, "copper and PVC; weigh your own", assumed=True),
    "stranded wire": MaterialData(3.0, "copper and PVC, half of each by area", assumed=True),
    "brass insert": MaterialData(8.4, "free-cutting brass CW614N, EN 12164: 8.4 g/cm³"),
    "LED board": MaterialData(
        1.85, "FR-4 laminate, IPC-4101; the packages of the LEDs are taken alike", assumed=True
    ),
    "camera": MaterialData(
        1.6, "a head of glass, plastic and board, between 1.2 and 1.9; weigh your own", assumed=True
    ),
}
"""Figures by the name of the material, which begins or is part of a part's `material`."""


def material_of(part: Part) -> str | None:
    """The key of `MATERIALS` that a part is made of; None where its material is not there."""
    if part.name == "camera":
        return "camera"
    if part.process == "pcb" or part.name.startswith("led_board"):
        return "LED board"
    named = next((name for name in MATERIALS if part.material.startswith(name)), None)
    return "steel" if named is None and "fastener" in part.tags else named


def density_g_cm3(part: Part, gel_density_kg_m3: float) -> float | None:
    """Density of a part: its own where it has one, or that of its material; None if unknown.

    The gel has that of its silicone, which the spec gives in kg/m³.
    """
    if part.density_g_cm3 is not None:
        return part.density_g_cm3
    if part.name == "gel_pad":
        return gel_density_kg_m3 / 1000
    material = material_of(part)
    return None if material is None else MATERIALS[material].density_g_cm3
