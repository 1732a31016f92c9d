"""Bill of materials."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable

from gelslim_cad.geometry.part import Part
from gelslim_cad.report import BomLine

DENSITY_G_CM3 = {
    "tough resin": 1.15,
    "PETG": 1.27,
    "PA12": 0.95,
    "cast acrylic": 1.18,
    "front-surface mirror": 2.5,
    "silicone sheet": 1.15,
}
"""Typical densities, for masses in the BOM only."""


def bill_of_materials(parts: Iterable[Part], gel_density_kg_m3: float) -> tuple[BomLine, ...]:
    """Lines in the order of the parts; screws of one kind share a line."""
    lines = []
    for part in parts:
        if part.quantity < 1:
            continue
        name = part.name
        if "fastener" in part.tags:
            name = name.rsplit("_", 1)[0]
        lines.append(
            BomLine(
                name,
                part.quantity,
                part.material,
                part.process,
                _mass_g(part, gel_density_kg_m3),
                part.note,
                not part.in_assembly,
            )
        )
    return tuple(lines)


def _mass_g(part: Part, gel_density_kg_m3: float) -> float | None:
    volume_cm3 = part.solid.Volume() / 1000
    if part.name == "gel_pad":
        return round(volume_cm3 * gel_density_kg_m3 / 1000, 2)
    for material, density in DENSITY_G_CM3.items():
        if part.material.startswith(material):
            return round(volume_cm3 * density, 2)
    return None


def bom_csv(lines: Iterable[BomLine]) -> bytes:
    """The bill as CSV (UTF-8, comma, quoted where needed)."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["part", "quantity", "material", "process", "use", "mass_g", "note"])
    for line in lines:
        use = "tooling" if line.tooling else "finger"
        mass = "" if line.mass_g is None else f"{line.mass_g:.2f}"
        writer.writerow(
            [line.name, line.quantity, line.material, line.process, use, mass, line.note]
        )
    return text.getvalue().encode()
