"""Figures of a sensor that bounds and costs of effects are computed from."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gelslim_twin.effects.circumstances import LEAST_LIGHT, SensorFigures
from ifem_export.errors import IfemError

if TYPE_CHECKING:
    from gelslim_optics.light.light_map import LightMap

DULLEST = 0.85
"""Light on the dullest place of a mottled coat over the mean: three standard deviations of the
mottle, and a part for the interpolation of the light."""
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
    camera = manifest["camera"]
    return figures(
        camera,
        size_mm=(cells[0] * size[0], cells[1] * size[1], cells[2] * size[2]),
        material=(material["youngs_modulus_mpa"], material["poissons_ratio"]),
        surface_nodes=mesh["surface_nodes"],
        layers=cells[2],
        markers=len(positions),
        marker_pitch_mm=_pitch(positions),
        marker_diameter_mm=float(np.median(diameters)),
        least_light=least_light(_stored_light(Path(path), manifest), positions, camera),
        **_skin_figures(manifest.get("skin")),
    )


def _skin_figures(record: Mapping[str, Any] | None) -> dict[str, Any]:
    """The figures of coat and fabric in a manifest."""
    if record is None:
        return {}
    from ifem_export.elements.skin import Skin

    skin = Skin.from_record(record)
    return {"skin_n_per_mm": skin.stiffness_n_per_mm, "skin_friction": skin.friction}


def _stored_light(folder: Path, manifest: Mapping[str, Any]) -> LightMap:
    """The light of a bundle; of one without, that which the twin then draws."""
    import numpy as np

    from gelslim_optics.light.light_map import LIGHT_FIELDS, LightMap, red_green_sides

    if manifest.get("light"):
        files = {n: manifest["arrays"][f"light_{n}"]["file"] for n in LIGHT_FIELDS}
        return LightMap.from_arrays({n: np.load(folder / file) for n, file in files.items()})
    cells, size = manifest["mesh"]["cells"], manifest["mesh"]["cell_size_mm"]
    length_mm, width_mm = (cells[k] * size[k] for k in (0, 1))
    return red_green_sides(length_mm, width_mm, decay_mm=0.8 * width_mm)


def least_light(light: LightMap, positions_mm: Any, camera: Mapping[str, Any]) -> float:
    """Light on the darkest dot at rest, before the lens takes its part.

    Args:
        light: The traced light.
        positions_mm: Dots (n, 2 or 3).
        camera: The camera's record.

    Returns:
        Over the mean of a lamp, summed over the channels that the camera has.
    """
    from gelslim_optics.camera.record import is_mono

    seen = light.at(positions_mm[:, 0], positions_mm[:, 1]) @ light.colour
    return float((seen[:, 0] if is_mono(camera) else seen.sum(axis=1)).min())


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
    skin_n_per_mm: float = 0.0,
    skin_friction: float | None = None,
    least_light: float | None = None,
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
        skin_n_per_mm: membrane stiffness of coat and fabric together.
        skin_friction: their friction against objects.
        least_light: light on the darkest dot before the lens takes its part, over the mean of a
            lamp and summed over the channels; None where it is not known.

    Raises:
        KeyError: the record lacks a value.
    """
    lens = camera.get("lens_distortion") or {}
    stack = tuple((float(v["thickness_mm"]), float(v["index"])) for v in camera["layers"])
    lift = sum(h * (1 - 1 / n) for h, n in stack)
    corners = list(product(*((-side / 2, side / 2) for side in size_mm[:2])))
    rays = [_ray(camera, (x, y, -lift)) for x, y in corners]
    images = [_images_mm(ray, stack, lift) for ray in rays]
    half_view_px = max(ray.off_axis for ray in rays) * float(camera["focal_px"])
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
        near_mm=min(nearer for nearer, _ in images),
        far_mm=max(farther for _, farther in images),
        half_view_px=half_view_px,
        tilt_deg=math.degrees(math.acos(min(1.0, float(camera["forward"][2])))),
        oblique_deg=max(math.degrees(ray.from_normal_rad) for ray in rays),
        layers_mm=stack,
        aperture_mm=float(camera.get("aperture_mm") or 0.0),
        focus_mm=float(camera.get("focus_mm") or 0.0),
        lens_distortion=tuple(sorted((k, v) for k, v in lens.items() if k != "model")),
        wide_lens=lens.get("model") == "kannala_brandt",
        skin_n_per_mm=skin_n_per_mm,
        skin_friction=skin_friction,
        least_light=(
            LEAST_LIGHT
            if least_light is None
            else DULLEST * least_light / (1 + (half_view_px / float(camera["focal_px"])) ** 2) ** 2
        ),
    )


@dataclass(frozen=True)
class _Ray:
    """Ray from the camera to a paraxial apparent point.

    Refraction makes a point of the outer surface (z = 0) appear nearer to the camera.
    """

    height_mm: float
    from_normal_rad: float
    cos_off_axis: float

    @property
    def off_axis(self) -> float:
        """Slope from the camera's axis."""
        return math.sqrt(max(0.0, 1 / self.cos_off_axis**2 - 1))


def _ray(camera: Mapping[str, Any], point: Vector) -> _Ray:
    way = [a - b for a, b in zip(point, camera["position_mm"], strict=True)]
    along = sum(a * b for a, b in zip(way, camera["forward"], strict=True))
    return _Ray(way[2], math.atan2(math.hypot(*way[:2]), way[2]), along / math.hypot(*way))


def _images_mm(
    ray: _Ray, stack: tuple[tuple[float, float], ...], lift_mm: float
) -> tuple[float, float]:
    """Distances along the axis of the tangential and the sagittal image (Coddington)."""
    cos, sin = math.cos(ray.from_normal_rad), math.sin(ray.from_normal_rad)
    air_mm = ray.height_mm + lift_mm - sum(thickness for thickness, _ in stack)
    tangential = sagittal = air_mm / cos
    for thickness, index in stack:
        cos_within = math.sqrt(1 - (sin / index) ** 2)
        sagittal += thickness / (index * cos_within)
        tangential += thickness * cos**2 / (index * cos_within**3)
    return tangential * ray.cos_off_axis, sagittal * ray.cos_off_axis
