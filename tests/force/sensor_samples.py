"""A whole sensor with frames of a press whose forces are known.

The truth comes from the pad at half the pitch with eight layers, not from the bundle's own mesh.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from camera_rig import off_centre_view
from synthetic import Frame, Look, grid_of_dots, render

from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.elements.material import Material
from ifem_export.markers.grid import MarkerGrid
from ifem_export.markers.interpolation import marker_to_node
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh
from ifem_export.operators.ladder import lumped, refined
from ifem_export.operators.surface_operator import surface_operator

NORMAL_N, SHEAR_N = 1.0, (0.3, -0.2)
PLACE_MM, RADIUS_MM = (1.0, -1.0), 3.0


@dataclass(frozen=True, eq=False)
class Press:
    """Full press: forces (c, 3) on the bundle's surface nodes and motions of nodes and markers."""

    force_n: np.ndarray
    nodes_mm: np.ndarray
    markers_mm: np.ndarray


@cache
def sensor_grid() -> MarkerGrid:
    return grid_of_dots()


@cache
def sensor_bundle() -> Bundle:
    """19 x 18 dots on 22 x 20.5 mm, 2 mm thick, four layers of cells of 0.76 x 0.85 mm."""
    outline = RoundedRectangle(length_mm=22.0, width_mm=20.5, corner_radius_mm=1.0)
    mesh, _ = build_pad_mesh(outline, 2.0, cells=(29, 24, 4))
    grid = sensor_grid()
    return build_bundle(
        mesh,
        Material(0.147, 0.3223, 1000.0),
        "bbar",
        marker_positions_mm=grid.positions_mm,
        marker_arrays=grid.labels,
        camera=off_centre_view().to_record(),
        with_stiffness=False,
    )


@cache
def press() -> Press:
    """A push with shear on a disc, as Hertz's pressure."""
    bundle = sensor_bundle()
    fine = refined(bundle.mesh)
    points = np.asarray(fine.nodes_mm)[fine.surface]
    away = np.hypot(points[:, 0] - PLACE_MM[0], points[:, 1] - PLACE_MM[1])
    shape = np.sqrt(np.maximum(1 - (away / RADIUS_MM) ** 2, 0.0))
    force = (shape / shape.sum())[:, None] * np.array([*SHEAR_N, -NORMAL_N])
    moved = surface_operator(fine, bundle.material, "bbar", "pcg").displacement(force)
    grid = np.column_stack([sensor_grid().positions_mm, np.zeros(len(sensor_grid()))])
    nodes = np.asarray(bundle.mesh.nodes_mm)[bundle.mesh.surface]
    return Press(
        lumped(force, fine, bundle.mesh),
        marker_to_node(points, nodes) @ moved,
        marker_to_node(points, grid) @ moved,
    )


def frame(share: float, look: Look | None = None) -> Frame:
    """The press at a share of its depth; 0 is the reference."""
    return render(
        sensor_grid(), off_centre_view(), look or Look(noise=2.0), share * press().markers_mm
    )


def stream(count: int, look: Look | None = None) -> list[Frame]:
    """Frames from rest to the full press, each with noise of its own."""
    look = look or Look(noise=2.0)
    steps = np.linspace(0, 1, count)
    return [frame(s, replace(look, seed=100 + k)) for k, s in enumerate(steps)]
