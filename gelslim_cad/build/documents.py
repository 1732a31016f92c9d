"""Tables, bill of materials, instructions and report of a build."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from gelslim_cad.build.instructions import build_guide
from gelslim_cad.build.manifest import FileEntry, json_bytes
from gelslim_cad.build.page import pictures, report_data
from gelslim_cad.build.writers import LIGHT_JSON
from gelslim_cad.checks import Check
from gelslim_cad.dimensions import Dimensions, definition
from gelslim_cad.geometry.part import Part
from gelslim_cad.report import BomLine, render_report
from gelslim_cad.solids.casting import cast_gel

if TYPE_CHECKING:
    from gelslim_cad.build.stages import Plan, Stages


Documents = dict[str, tuple[bytes, str]]
DENSITY_G_CM3 = {
    "tough resin": 1.15,
    "PETG": 1.27,
    "PA12": 0.95,
    "cast acrylic": 1.18,
    "front-surface mirror": 2.5,
    "silicone sheet": 1.15,
}
"""Typical densities, for masses in the BOM only."""


def data_documents(stages: Stages, plan: Plan, bom: tuple[BomLine, ...]) -> Documents:
    """Spec copy, dimensions.json, checks.json and BUILD.md."""
    d = stages.dimensions
    batch = cast_gel(d).weighable()
    return {
        "spec.yaml": (stages.loaded.text.encode(), "the spec this was built from"),
        "dimensions.json": (
            json_bytes(dimensions_content(stages, d)),
            "dependent dimensions with formulas and inputs",
        ),
        "checks.json": (checks_json(plan.checks), "design rules with margins"),
        "BUILD.md": (
            build_guide(d, stages.grid, batch, bom, stages.name),
            "how to make and assemble it",
        ),
    }


def dimensions_content(stages: Stages, d: Dimensions) -> dict[str, Any]:
    """Every dependent dimension with unit, formula, source and inputs."""
    return {
        "format": "gelslim-dimensions/1",
        "name": stages.name,
        "spec_hash": stages.spec_hash,
        "binding": list(stages.binding),
        "dimensions": {
            name: {
                "value": value,
                "unit": definition(name).unit,
                "meaning": definition(name).title,
                "formula": definition(name).formula,
                "source": definition(name).source,
                "inputs": {
                    n: plain(v)
                    for n, v in d.inputs(name)
                    if isinstance(v, (int, float, str, tuple)) or v is None
                },
            }
            for name, value in d.values.items()
        },
    }


def report_document(
    stages: Stages,
    plan: Plan,
    bom: tuple[BomLine, ...],
    contents: Mapping[str, bytes],
    files: Mapping[str, FileEntry],
    missing: str,
) -> tuple[bytes, str]:
    """The report page; `missing` says why there are no pictures, where there are none."""
    shown = {path: data for path, data in contents.items() if path.startswith("pictures/")}
    data = report_data(
        stages.name,
        stages.loaded.text,
        stages.spec_hash,
        stages.dimensions,
        stages.grid,
        plan.checks,
        stages.binding,
        contents.get(f"{stages.name}.glb", b""),
        pictures(shown, missing),
        files,
        bom,
        contents.get(LIGHT_JSON, b""),
        shown,
    )
    return render_report(data), "report with 3D viewer, offline"


def checks_json(checks: tuple[Check, ...]) -> bytes:
    """Content of checks.json."""
    return json_bytes([{k: plain(v) for k, v in asdict(c).items()} for c in checks])


def plain(value: Any) -> Any:
    """Replace tuples and numpy scalars by what JSON can hold."""
    if isinstance(value, tuple):
        return [plain(v) for v in value]
    return value.item() if hasattr(value, "item") else value


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
