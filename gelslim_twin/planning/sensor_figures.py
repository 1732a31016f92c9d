"""Figures of a sensor for the planner, from the record of its bundle."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

from gelslim_twin.effects.circumstances import SensorFigures
from ifem_export.errors import IfemError

Vector = tuple[float, float, float]


def bundle_figures(path: str | os.PathLike[str]) -> SensorFigures:
    """Read the figures of a sensor from a bundle; of its arrays only the markers are loaded.

    Args:
        path: Folder of the bundle.

    Returns:
        The figures that bounds and costs of effects are computed from.

    Raises:
        IfemError: The folder is no bundle, or the bundle has no markers or no camera.
    """
    import numpy as np

    from ifem_export.bundle.manifest import read_manifest

    manifest = read_manifest(Path(path))
    markers, mesh, material = manifest["markers"], manifest["mesh"], manifest["material"]
    if not markers or not manifest.get("camera"):
        raise IfemError(f"{path}: the bundle has no markers or no camera; make it from a spec")
    positions = np.load(Path(path) / "marker_positions_mm.npy")
    diameters = np.load(Path(path) / "marker_diameter_mm.npy")
    cells, size = mesh["cells"], mesh["cell_size_mm"]
    return figures(
        manifest["camera"],
        size_mm=(cells[0] * size[0], cells[1] * size[1], cells[2] * size[2]),
        material=(material["youngs_modulus_mpa"], material["poissons_ratio"]),
        surface_nodes=mesh["surface_nodes"],
        layers=cells[2],
        markers=len(positions),
        marker_pitch_mm=_pitch(positions),
        marker_diameter_mm=float(np.median(diameters)),
    )


def _pitch(positions: Any) -> float:
    """Median distance of a dot to its nearest neighbour."""
    import numpy as np
    from scipy.spatial import cKDTree

    if len(positions) < 2:
        return 1.0
    return float(np.median(cKDTree(positions).query(positions, 2)[0][:, 1]))


def figures(
    camera: Mapping[str, Any],
    *,
    size_mm: Vector,
    material: tuple[float, float],
    surface_nodes: int,
    layers: int,
    markers: int,
    marker_pitch_mm: float,
    marker_diameter_mm: float,
) -> SensorFigures:
    """Figures of a sensor.

    Args:
        camera: the camera's record as in a bundle.
        size_mm: length, width and thickness of the pad.
        material: Young's modulus in MPa and Poisson's ratio.
        surface_nodes: nodes of the outer surface.
        layers: cell layers.
        markers: dots printed.
        marker_pitch_mm: distance between neighbours.
        marker_diameter_mm: of a usual dot.

    Raises:
        KeyError: the record lacks a value.
    """
    stack = tuple((float(v["thickness_mm"]), float(v["index"])) for v in camera["layers"])
    lift = sum(h * (1 - 1 / n) for h, n in stack)
    corners = list(product(*((-side / 2, side / 2) for side in size_mm[:2])))
    seen = [_seen(camera, (x, y, -lift)) for x, y in corners]
    distances = [z for z, _ in seen]
    return SensorFigures(
        length_mm=size_mm[0],
        width_mm=size_mm[1],
        thickness_mm=size_mm[2],
        youngs_modulus_mpa=material[0],
        poissons_ratio=material[1],
        surface_nodes=surface_nodes,
        layers=layers,
        markers=markers,
        marker_pitch_mm=marker_pitch_mm,
        marker_diameter_mm=marker_diameter_mm,
        focal_px=float(camera["focal_px"]),
        image_width_px=int(camera["image_width_px"]),
        image_height_px=int(camera["image_height_px"]),
        near_mm=min(distances),
        far_mm=max(distances),
        half_view_px=max(r for _, r in seen) * float(camera["focal_px"]),
        tilt_deg=math.degrees(math.acos(min(1.0, float(camera["forward"][2])))),
        oblique_deg=max(_oblique_deg(camera, (x, y, -lift)) for x, y in corners),
        layers_mm=stack,
        aperture_mm=float(camera.get("aperture_mm") or 0.0),
        focus_mm=float(camera.get("focus_mm") or 0.0),
        lens_distortion=tuple(sorted((camera.get("lens_distortion") or {}).items())),
    )


def _seen(camera: Mapping[str, Any], point: Vector) -> tuple[float, float]:
    """Distance in mm along the camera's axis of an apparent point, and its slope from the axis.

    Refraction makes a point of the outer surface (z = 0) appear nearer to the camera.
    """
    way = [a - b for a, b in zip(point, camera["position_mm"], strict=True)]
    along = sum(a * b for a, b in zip(way, camera["forward"], strict=True))
    across = math.sqrt(max(0.0, sum(a * a for a in way) - along * along))
    return along, across / along


def _oblique_deg(camera: Mapping[str, Any], point: Vector) -> float:
    """Angle in air of the ray to an apparent point, from the gel's normal."""
    x, y, z = (a - b for a, b in zip(point, camera["position_mm"], strict=True))
    return math.degrees(math.atan2(math.hypot(x, y), z))
