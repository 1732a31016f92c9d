"""Small pads with known surface forces."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from gelslim_force.contact.normal_motion import NormalModel
from gelslim_force.contact.normal_source import NormalReading
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.elements.material import Material
from ifem_export.markers.grid import build_marker_grid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh


@cache
def small_bundle(layers: int = 4, poissons_ratio: float = 0.3223) -> Bundle:
    """A pad of 12 x 10 x 2 mm with cells of 0.5 x 0.42 mm and 10 x 8 markers."""
    outline = RoundedRectangle(length_mm=12.0, width_mm=10.0, corner_radius_mm=1.0)
    mesh, _ = build_pad_mesh(outline, 2.0, cells=(24, 24, layers))
    grid = build_marker_grid(10, 8, 1.1, 0.45)
    return build_bundle(
        mesh,
        Material(0.147, poissons_ratio, 1000.0),
        "bbar",
        marker_positions_mm=grid.positions_mm,
        with_stiffness=False,
    )


def node_forces_n(model: NormalModel, found: NormalReading) -> np.ndarray:
    """(c,) normal forces, positive into the gel, under which the touched nodes move as found."""
    force = np.zeros(len(found.w_mm))
    nodes = np.flatnonzero(found.touched)
    force[nodes] = np.linalg.solve(model.compliance.block(nodes), -found.w_mm[nodes])
    return force


def depth_sigma_mm(model: NormalModel, found: NormalReading, centre_mm: ArrayLike) -> float:
    """Standard deviation of the depth: that of the node nearest to the lowest point."""
    return float(found.sigma_mm[np.argmin(np.hypot(*(model.points_mm - centre_mm).T))])


def hertz_like(points_mm: np.ndarray, normal_n: float, shear_n: tuple[float, float]) -> np.ndarray:
    """Forces (c, 3) on a disc of 2.2 mm about (0.4, -0.3) with the given resultant."""
    away = np.hypot(points_mm[:, 0] - 0.4, points_mm[:, 1] + 0.3)
    shape = np.sqrt(np.maximum(1 - (away / 2.2) ** 2, 0.0))
    shape /= shape.sum()
    return shape[:, None] * np.array([*shear_n, -normal_n])
