"""The report's content, gathered from the parts of a build."""

from __future__ import annotations

import json
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from gelslim_cad.build.fingerprint import versions
from gelslim_cad.build.manifest import FileEntry
from gelslim_cad.checks import Check
from gelslim_cad.dimensions import Dimensions, definition
from gelslim_cad.geometry.optics import virtual_camera
from gelslim_cad.markers.outline import Outline
from gelslim_cad.report import (
    BomLine,
    CameraView,
    DimensionRow,
    FileRow,
    Note,
    Picture,
    ReportData,
)
from gelslim_cad.report.view_figures import projection_sentence
from ifem_export.markers.grid import MarkerGrid

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
    "pictures/irradiance.png": ("Light on the gel", "Red and green on the gel's coat."),
    "pictures/light_ratio.png": (
        "Brightness against bend radius",
        "Over a straight guide with glued 45° mirrors, with 95 % intervals.",
    ),
}


def dimension_rows(d: Dimensions) -> tuple[DimensionRow, ...]:
    """Every dependent dimension with its formula and inputs."""
    rows = []
    for name, value in d.values.items():
        entry = definition(name)
        inputs = tuple((n, v) for n, v in d.inputs(name) if isinstance(v, (int, float, str)))
        rows.append(
            DimensionRow(
                name=name,
                value=value,
                unit=entry.unit,
                formula=entry.formula,
                inputs=inputs,
                source=entry.source,
                group=name.split(".")[0],
            )
        )
    return tuple(rows)


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
    files: Mapping[str, bytes], problem: str, wanted: Mapping[str, tuple[str, str]] = PICTURES
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
    name: str,
    spec_text: str,
    spec_hash: str,
    d: Dimensions,
    grid: MarkerGrid,
    checks: tuple[Check, ...],
    binding: tuple[str, ...],
    glb: bytes,
    shown: tuple[Picture, ...],
    files: Mapping[str, FileEntry],
    bom: tuple[BomLine, ...],
    light: bytes = b"",
    drawn: Mapping[str, bytes] = MappingProxyType({}),
) -> ReportData:
    """Everything the report shows, as plain values; `light` is the build's light.json,
    `drawn` its pictures by path."""
    return ReportData(
        name=name,
        spec_text=spec_text,
        spec_hash=spec_hash,
        headline=headline(d),
        dimensions=dimension_rows(d),
        rules=checks,
        binding=binding,
        glb=glb,
        pictures=shown,
        camera_view=view_of_markers(d, grid),
        files=tuple(
            FileRow(path, e.size_bytes, e.sha256, e.purpose) for path, e in sorted(files.items())
        ),
        bom=bom,
        light=pictures(drawn, "", LIGHT_PICTURES) if light else (),
        projection=pictures(drawn, "", PROJECTION_PICTURES),
        projection_notes=(Note("Projection", projection_sentence(d)),),
        light_notes=light_notes(light) if light else (),
        versions=versions(),
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
    blur_px = blur_mm * camera.focal_px / camera.apparent_distance_mm(points)
    outline = Outline.rounded_rectangle(
        d["design.gel.length_mm"], d["design.gel.width_mm"], d["design.gel.corner_radius_mm"]
    ).flattened(0.02)
    edge = np.column_stack([outline, np.zeros(len(outline))])
    return CameraView.from_arrays(
        (camera.image_width_px, camera.image_height_px),
        camera.project(points),
        axes,
        angle,
        blur_px,
        camera.project(edge),
        anchors=np.flatnonzero(np.asarray(grid.kind) != 0).tolist(),
    )
