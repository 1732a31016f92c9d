"""Instructions, orders and report of a build, which tell of its other files."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.assembly.record import read_steps
from gelslim_cad.build.assembly_steps import ToldStep, fasteners_told, motion, told_steps
from gelslim_cad.build.draft import Draft
from gelslim_cad.build.fingerprint import versions
from gelslim_cad.build.instructions import after_assembly, before_assembly, build_guide
from gelslim_cad.build.light_notes import light_notes, light_pictures
from gelslim_cad.build.manifest import FileEntry, entry, json_bytes
from gelslim_cad.build.order_files import ASSEMBLY_JSON, step_picture
from gelslim_cad.build.printing import print_hints, printed_parts
from gelslim_cad.build.stages import Plan, Stages, kerf_mm
from gelslim_cad.build.work import Files
from gelslim_cad.build.writers import (
    LIGHT_JSON,
    LIGHT_PATHS_JSON,
    TOLERANCE_JSON,
)
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import has_markers
from gelslim_cad.geometry.optics import virtual_camera
from gelslim_cad.geometry.overlay import Overlay, light_paths
from gelslim_cad.markers.outline import Outline
from gelslim_cad.markers.process import MARKING_PROCESSES
from gelslim_cad.ordering.cost import Cost
from gelslim_cad.ordering.line import BomLine
from gelslim_cad.ordering.orders import OrderInput, order_archives
from gelslim_cad.ordering.texts import PrintOrder
from gelslim_cad.printability.rules import PrintedPart
from gelslim_cad.report.build_page import PageStep, render_build_page
from gelslim_cad.report.camera_view import CameraView
from gelslim_cad.report.render import Picture, ReportData, render_report
from gelslim_cad.report.tables import Note
from gelslim_cad.report.view_figures import projection_sentence
from ifem_export.bundle.manifest import LADDER, MANIFEST
from ifem_export.markers.grid import MarkerGrid
from ifem_export.operators.operator_ladder import OperatorLadder

OF_MARKERS = ("marker_grid.", "pad_mesh.")
"""Groups of dimensions that the report leaves out for a gel without markers."""
BUNDLE_JSON, OPERATORS_JSON = f"bundle/{MANIFEST}", f"bundle/{LADDER}"
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


def documents(
    stages: Stages,
    plan: Plan,
    drafted: Draft,
    contents: Mapping[str, bytes],
    files: Mapping[str, FileEntry],
    missing: str,
) -> Files:
    """Everything that is quick to write: the draft, instructions, orders, report.

    `contents` are those of the built files by path, `files` their entries; `missing` says why
    there are no pictures, where there are none.
    """
    d, grid = stages.dimensions, stages.grid
    parts = (*plan.finger, *plan.tooling)
    boards, bom, cost = drafted.boards, drafted.bom, drafted.cost
    steps = read_steps(json.loads(contents[ASSEMBLY_JSON]))
    made = drafted.files | {
        "checks.json": (json_bytes([asdict(c) for c in plan.checks]), "design rules with margins"),
        "BUILD.md": (build_guide(d, grid, bom, stages.name, steps), "how to make and assemble it"),
        "BUILD.html": (
            build_page(stages, bom, told_steps(d, boards, steps), contents),
            "the same with a picture of each step, to tick off or to print; offline",
        ),
    }
    printed = printed_parts(d, parts, contents)
    given = OrderInput(
        stages.name,
        bom,
        {**contents, **{path: data for path, (data, _) in made.items()}},
        PrintOrder(d["manufacturing.print_tolerance_mm"], print_hints(bom, printed)),
        {p.name: kerf_mm(d, p) for p in parts},
        tuple(item.board.name for item in boards.boards),
        stencil_layers(d),
    )
    made |= order_archives(given, cost, stages.prices.entries)
    own = {path: entry(data, purpose, "documents") for path, (data, purpose) in made.items()}
    page = render_report(
        report_data(stages, plan, (bom, cost), printed, contents, {**files, **own}, missing)
    )
    made["report.html"] = (page, "report with 3D viewer, offline")
    return made


def build_page(
    stages: Stages,
    bom: tuple[BomLine, ...],
    told: Sequence[ToldStep],
    contents: Mapping[str, bytes],
) -> bytes:
    """BUILD.html; `contents` are those of the built files by path."""
    d = stages.dimensions
    steps = [
        PageStep(
            t.step.key,
            t.text.title,
            t.text.minutes,
            motion(t.step),
            t.text.do,
            fasteners_told(t.step),
            t.text.look,
            contents.get(step_picture(t.number, t.step.key), b""),
        )
        for t in told
    ]
    before = before_assembly(d, stages.grid, bom, stages.name, told)
    return render_build_page(stages.name, stages.spec_hash, before, steps, after_assembly(d))


def stencil_layers(d: Dimensions) -> tuple[str, ...]:
    """Gerber files of the marker stencil where the spec marks with one; empty otherwise."""
    if d["manufacturing.marking_process"] != "stencil":
        return ()
    return tuple(f for f in MARKING_PROCESSES["stencil"].files if f.endswith(".gbr"))


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
        (
            f"{'Marker' if has_markers(d) else 'Detail'} at the gel's far edge",
            f"{d['view.marker_across_px']:.1f} × {d['view.marker_along_px']:.1f} px",
        ),
    )


def pictures(
    files: Mapping[str, bytes], wanted: Mapping[str, tuple[str, str]], problem: str = ""
) -> tuple[Picture, ...]:
    """Rendered pictures; where one is missing the report says why."""
    return tuple(
        Picture(title, caption, files.get(path, b""), "" if path in files else problem)
        for path, (title, caption) in wanted.items()
    )


def report_data(
    stages: Stages,
    plan: Plan,
    bill: tuple[tuple[BomLine, ...], Cost],
    printed: tuple[PrintedPart, ...],
    contents: Mapping[str, bytes],
    files: Mapping[str, FileEntry],
    missing: str,
) -> ReportData:
    """Everything the report shows; `missing` says why there are no pictures, where none are.

    `contents` are those of the built files by path, `files` their entries with the documents',
    `bill` the priced bill of materials with its sums, `printed` the measured printed parts.
    """
    d = stages.dimensions
    overlays = (*stages.overlays, *traced_overlays(contents[LIGHT_PATHS_JSON]))
    explode_mm = {part.name: part.explode_mm for part in plan.finger}
    return ReportData(
        name=stages.name,
        spec_text=stages.loaded.text,
        spec_hash=stages.spec_hash,
        headline=headline(d),
        dimensions={
            name: d.record(name)
            for name in d.values
            if has_markers(d) or not name.startswith(OF_MARKERS)
        },
        rules=plan.checks,
        binding=stages.binding,
        glb=contents[f"{stages.name}.glb"],
        pictures=pictures(contents, PICTURES, missing),
        camera_view=view_of_markers(d, stages.grid),
        files=files,
        bom=bill[0],
        cost=bill[1],
        printed=printed,
        light=pictures(contents, light_pictures(d)),
        light_notes=light_notes(contents[LIGHT_JSON]),
        projection=pictures(contents, PROJECTION_PICTURES),
        projection_notes=(Note("Projection", projection_sentence(d)),),
        versions=versions(),
        tolerance=json.loads(contents[TOLERANCE_JSON]),
        overlays=tuple(overlay.record(explode_mm) for overlay in overlays),
        assembly=json.loads(contents[ASSEMBLY_JSON]),
        operators=OperatorLadder.from_record(json.loads(contents[OPERATORS_JSON])),
        operator=json.loads(contents[BUNDLE_JSON])["ladder"]["operator"],
    )


def traced_overlays(content: bytes) -> tuple[Overlay, ...]:
    """The light paths that were written as data, for the 3D view."""
    paths = json.loads(content)["paths"]
    return light_paths([(path["colour"], np.array(path["points_mm"])) for path in paths])


def view_of_markers(d: Dimensions, grid: MarkerGrid | None) -> CameraView:
    """Exact projection of the undeformed grid: centres, ellipse axes and blur in px."""
    camera = virtual_camera(d)
    centres = np.zeros((0, 2)) if grid is None else grid.positions_mm
    diameters = np.zeros(0) if grid is None else grid.diameter_mm
    points = np.column_stack([centres, np.zeros(len(centres))])
    # A small circle maps to the ellipse J·circle; its half axes are the singular values of J.
    left, stretch, _ = np.linalg.svd(camera.jacobian(points))
    axes = stretch * diameters[:, None]
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
        anchors=_anchors(grid),
    )


def _anchors(grid: MarkerGrid | None) -> frozenset[int]:
    """Indices of the markers that differ from the lattice."""
    if grid is None:
        return frozenset()
    return frozenset(np.flatnonzero(np.asarray(grid.kind) != 0).tolist())


def _pairs(array: NDArray[np.float64]) -> tuple[tuple[float, float], ...]:
    return tuple((u, v) for u, v in array.tolist())
