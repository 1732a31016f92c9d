"""Tables, bill of materials, instructions and report of a build."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING

from gelslim_cad.build.instructions import build_guide
from gelslim_cad.build.manifest import FileEntry, entry, json_bytes
from gelslim_cad.build.page import report_data
from gelslim_cad.build.work import Files
from gelslim_cad.geometry.part import Part
from gelslim_cad.markers.write import render_marker_files
from gelslim_cad.report.render import render_report
from gelslim_cad.report.tables import BomLine
from gelslim_cad.sensor import marker_print

if TYPE_CHECKING:
    from gelslim_cad.build.stages import Plan, Stages


DENSITY_G_CM3 = {
    "tough resin": 1.15,
    "PETG": 1.27,
    "PA12": 0.95,
    "cast acrylic": 1.18,
    "front-surface mirror": 2.5,
    "silicone sheet": 1.15,
}
"""Typical densities, for masses in the BOM only."""


def documents(
    stages: Stages,
    plan: Plan,
    contents: Mapping[str, bytes],
    files: Mapping[str, FileEntry],
    missing: str,
) -> Files:
    """Everything that is quick to write: markers, tables, instructions, report.

    `contents` are those of the built files by path, `files` their entries; `missing` says why
    there are no pictures, where there are none.
    """
    d, grid = stages.dimensions, stages.grid
    parts = (*plan.finger, *plan.tooling)
    bom = bill_of_materials(parts, d["material.gel.density_kg_m3"])
    dimensions = {
        "format": "gelslim-dimensions/1",
        "name": stages.name,
        "spec_hash": stages.spec_hash,
        "binding": stages.binding,
        "dimensions": {name: d.record(name) for name in d.values},
    }
    markers = render_marker_files(grid, *marker_print(d, grid))
    made: Files = {f"markers/{n}": (data, "marker print, 1:1") for n, data in markers.items()}
    made |= {
        "spec.yaml": (stages.loaded.text.encode(), "the spec this was built from"),
        "dimensions.json": (
            json_bytes(dimensions),
            "dependent dimensions with formulas and inputs",
        ),
        "checks.json": (json_bytes([asdict(c) for c in plan.checks]), "design rules with margins"),
        "BUILD.md": (build_guide(d, grid, bom, stages.name), "how to make and assemble it"),
        "BOM.csv": (bom_csv(bom), "bill of materials"),
    }
    own = {path: entry(data, purpose, "documents") for path, (data, purpose) in made.items()}
    page = render_report(report_data(stages, plan, bom, contents, {**files, **own}, missing))
    made["report.html"] = (page, "report with 3D viewer, offline")
    return made


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
