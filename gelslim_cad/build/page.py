"""The report's content, gathered from the parts of a build."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.build.fingerprint import versions
from gelslim_cad.build.manifest import FileEntry
from gelslim_cad.build.writers import LIGHT_JSON
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.optics import virtual_camera
from gelslim_cad.markers.outline import Outline
from gelslim_cad.report.camera_view import CameraView
from gelslim_cad.report.render import Picture, ReportData
from gelslim_cad.report.tables import BomLine, Note
from gelslim_cad.report.view_figures import projection_sentence
from ifem_export.markers.grid import MarkerGrid

if TYPE_CHECKING:
    from gelslim_cad.build.stages import Plan, Stages

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
