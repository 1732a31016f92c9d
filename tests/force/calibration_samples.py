"""Bundles of small sensors for the calibration tests."""

from __future__ import annotations

from typing import Any

import numpy as np
from camera_rig import finger_view
from numpy.typing import NDArray
from synthetic import Look, render

from gelslim_force.calibration.camera_deviation import deviated_camera
from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.elements.material import Material
from ifem_export.markers.grid import MarkerGrid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh


def small_bundle(grid: MarkerGrid, camera: VirtualCamera | None = None) -> Bundle:
    """A coarse pad two pitches larger than the print, with the print and a camera."""
    rows, columns = grid.lattice_shape
    outline = RoundedRectangle(
        length_mm=(rows + 1) * grid.pitch_mm,
        width_mm=(columns + 1) * grid.pitch_mm,
        corner_radius_mm=1.0,
    )
    mesh, _ = build_pad_mesh(outline, 2.0, pitch_mm=1.0, layers=1)
    return build_bundle(
        mesh,
        Material(0.147, 0.3223, 1000.0),
        "full",
        marker_positions_mm=grid.positions_mm,
        marker_arrays=grid.labels,
        camera=(camera or finger_view()).to_record(),
        with_stiffness=False,
    )


BUILD = np.array([0.8, -0.9, 0.7, 0.15, -0.2, 0.12, 1.6, -0.04, 0.01, 0.001, -0.001, 0.9, -1.2])
"""Deviations of a built camera, see `camera_deviation.PARAMETERS`."""


def seen_by(
    grid: MarkerGrid,
    values: NDArray[np.float64],
    moved_mm: NDArray[np.float64] | None = None,
    **look: Any,
) -> NDArray[np.uint8]:
    """A frame of the print by a camera that deviates from the finger's."""
    return render(grid, deviated_camera(finger_view(), values), Look(**look), moved_mm).image
