"""The camera's view of the printed markers, for the report."""

from __future__ import annotations

import numpy as np

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.sight import virtual_camera
from gelslim_cad.markers.outline import Outline
from gelslim_cad.report import CameraView
from ifem_export.markers.grid import MarkerGrid


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
