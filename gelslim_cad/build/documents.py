"""Tables, bill of materials, instructions and report of a build."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.build.fingerprint import versions
from gelslim_cad.build.instructions import build_guide
from gelslim_cad.build.manifest import FileEntry, entry, json_bytes
from gelslim_cad.build.work import Files
from gelslim_cad.build.writers import LIGHT_JSON, TOLERANCE_JSON
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.optics import virtual_camera
from gelslim_cad.geometry.part import Part
from gelslim_cad.markers.outline import Outline
from gelslim_cad.markers.write import render_marker_files
from gelslim_cad.report.camera_view import CameraView
from gelslim_cad.report.render import Picture, ReportData, render_report
from gelslim_cad.report.tables import BomLine, Note
from gelslim_cad.report.view_figures import projection_sentence
from gelslim_cad.sensor import marker_print
from ifem_export.markers.grid import MarkerGrid

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
PICTURES = {
    "pictures/whole.png": ("The finger", "Assembled, seen from the tip."),
    "pictures/exploded.png": ("Exploded", "Every part on its way into the finger."),
    "pictures/section.png": ("Section", "Cut along the mid-plane: camera, mirror, window, gel."),
    "pictures/section_across.png": ("Section across", "Light guide, LED channels and baffles."),
}
PROJECTION_PICTURES = {
    "pictures/projection_error.png": (
        "Projection error left by each formula",
        "Against the exact refracted ray, over the pad, for a press of 0.5 mm.",
    ),
}
LIGHT_PICTURES = {
    "pictures/light_paths.png": ("Light paths", "From both LED rows, traced through the guide."),
    "pictures/irradiance.png": ("Light on the gel", "That of each strip on the gel's coat."),
    "pictures/light_ratio.png": (
        "Brightness against bend radius",
        "Over a straight guide with glued 45° mirrors, with 95 % intervals.",
    ),
}


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


def headline(d: Dimensions) -> tuple[tuple[str, str], ...]:
    """The numbers a reader looks for first."""
    return (
        ("Thickness", f"{d['finger.thickness_mm']:.2f} mm"),
        ("Width", f"{d['finger.width_mm']:.2f} mm"),
        ("Length", f"{d['finger.length_mm']:.2f} mm"),
        (
            "Gel",
            f"{d['design.gel.length_mm']:g} × {d['design.gel.width_mm']:g} × "
            f"{d['stack.gel_total_mm']:g} mm",
        ),
        ("Keystone", f"{d['view.keystone']:.3f}"),
        ("Largest blur", f"{d['view.far_blur_mm']:.3f} mm"),
        ("Marker, far edge", f"{d['view.marker_along_px']:.1f} px"),
    )


def pictures(
    files: Mapping[str, bytes], wanted: Mapping[str, tuple[str, str]], problem: str = ""
) -> tuple[Picture, ...]:
    """Rendered pictures; where one is missing the report says why."""
    return tuple(
        Picture(title, caption, files.get(path, b""), "" if path in files else problem)
        for path, (title, caption) in wanted.items()
    )


def light_notes(record: bytes) -> tuple[Note, ...]:
    """Certificate, comparison and exposure from a build's light.json."""
    light = json.loads(record)
    certificate = " ".join(light["certificate"]["sentences"])
    compared = "\n".join(f"The guide is {c['sentence']}." for c in light["comparisons"])
    exposed = "\n".join(f"{e['sentence']}." for e in light["exposures"])
    return (
        Note("Total internal reflection", certificate),
        Note("Brightness", compared),
        Note("Exposure and frame rate", exposed),
    )


def report_data(
    stages: Stages,
    plan: Plan,
    bom: tuple[BomLine, ...],
    contents: Mapping[str, bytes],
    files: Mapping[str, FileEntry],
    missing: str,
) -> ReportData:
    """Everything the report shows; `missing` says why there are no pictures, where none are.

    `contents` are those of the built files by path, `files` their entries with the documents'.
    """
    d = stages.dimensions
    return ReportData(
        name=stages.name,
        spec_text=stages.loaded.text,
        spec_hash=stages.spec_hash,
        headline=headline(d),
        dimensions={name: d.record(name) for name in d.values},
        rules=plan.checks,
        binding=stages.binding,
        glb=contents[f"{stages.name}.glb"],
        pictures=pictures(contents, PICTURES, missing),
        camera_view=view_of_markers(d, stages.grid),
        files=files,
        bom=bom,
        light=pictures(contents, LIGHT_PICTURES),
        light_notes=light_notes(contents[LIGHT_JSON]),
        projection=pictures(contents, PROJECTION_PICTURES),
        projection_notes=(Note("Projection", projection_sentence(d)),),
        versions=versions(),
        tolerance=json.loads(contents[TOLERANCE_JSON]),
    )


def view_of_markers(d: Dimensions, grid: MarkerGrid) -> CameraView:
    """Exact projection of the undeformed grid: centres, ellipse axes and blur in px."""
    camera = virtual_camera(d)
    points = np.column_stack([grid.positions_mm, np.zeros(len(grid))])
    # A small circle maps to the ellipse J·circle; its half axes are the singular values of J.
    left, stretch, _ = np.linalg.svd(camera.jacobian(points))
    axes = stretch * grid.diameter_mm[:, None]
    angle = np.degrees(np.arctan2(left[:, 1, 0], left[:, 0, 0]))
    blur_mm = camera.blur_on_gel_mm(points, d["view.aperture_mm"], d["view.focus_mm"])
    blur_px = blur_mm * camera.focal_px / camera.apparent_distances_mm(points)[:, 0]
    outline = Outline.rounded_rectangle(
        d["design.gel.length_mm"], d["design.gel.width_mm"], d["design.gel.corner_radius_mm"]
    ).flattened(0.02)
    edge = np.column_stack([outline, np.zeros(len(outline))])
    return CameraView(
        image_width_px=float(camera.image_width_px),
        image_height_px=float(camera.image_height_px),
        markers_px=_pairs(camera.project(points)),
        marker_axes_px=_pairs(axes),
        marker_angle_deg=tuple(angle.tolist()),
        blur_px=tuple(blur_px.tolist()),
        outline_px=_pairs(camera.project(edge)),
        anchors=frozenset(np.flatnonzero(np.asarray(grid.kind) != 0).tolist()),
    )


def _pairs(array: NDArray[np.float64]) -> tuple[tuple[float, float], ...]:
    return tuple((u, v) for u, v in array.tolist())
