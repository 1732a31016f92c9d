"""The planner's input: figures of a scene's motion and tool, and of its sensor."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from pathlib import Path
from typing import Any

from gelslim_twin.effects.circumstances import (
    LEAST_LIGHT,
    Circumstances,
    MotionFigures,
    SensorFigures,
)
from gelslim_twin.effects.contact_estimate import Footprint
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.planner import PlanError, Question, make_plan
from gelslim_twin.scene.footprint import tool_footprint
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.reader import LoadedScene
from gelslim_twin.scene.scene import Contact
from ifem_export.errors import IfemError

HIGHEST_MM, LEVELS = 20.0, 100
"""Heights over its lowest point at which a tilted tool is searched for its lowest point."""
JUST_TOUCHING_MM = 1e-9
DULLEST = 0.85
"""Light on the dullest place of a mottled coat over the mean: three standard deviations of the
mottle, and a part for the interpolation of the light."""
Vector = tuple[float, float, float]


def plan_scene(loaded: LoadedScene, sensor: SensorFigures) -> Plan:
    """Choose the effects that a scene needs by their bounds alone.

    Args:
        loaded: The scene.
        sensor: Figures of its sensor, for example from `bundle_figures`.

    Returns:
        Every effect with its size, whether it is simulated, and how finely.

    Raises:
        InputError: An effect is switched off without which something observed cannot be computed;
            it names the line.
    """
    return plan_asked(loaded, question(loaded, sensor))


def plan_asked(loaded: LoadedScene, asked: Question) -> Plan:
    """The plan of a scene's question, such as one with a probe. Raises as `plan_scene`."""
    try:
        return make_plan(asked)
    except PlanError as error:
        name = f"effects.{error.effect}" if error.effect else "observe"
        used = f"{name}.use" if f"{name}.use" in loaded.source_map else name
        raise loaded.problem(used, "off", error.message, error.remedy) from None


def question(loaded: LoadedScene, sensor: SensorFigures) -> Question:
    """Observables, tolerances and circumstances of a scene, as the planner takes them."""
    scene = loaded.scene
    if loaded.look is not None or (scene.vary is not None and scene.vary.light_gain is not None):
        # Photographed light and lamps of any brightness are not those of the design.
        sensor = replace(sensor, least_light=min(LEAST_LIGHT, sensor.least_light))
    footprint = tool_footprint(
        scene.indenters, loaded.folder, sensor.length_mm * sensor.width_mm, sensor.node_pitch_mm
    )
    return Question(
        scene.name,
        scene.observe,
        scene.tolerance.force_n,
        scene.tolerance.image_px,
        Circumstances(
            sensor,
            motion_figures(loaded.poses, footprint),
            footprint,
            contact_friction(scene.contact, sensor.skin_friction),
            scene.effects.parameters(),
        ),
    )


def contact_friction(contact: Contact, of_skin: float | None) -> float:
    """Coefficient of friction of a scene: its own, else that of the gel's skin, else 0."""
    if of_skin is None or "friction" in contact.model_fields_set:
        return contact.friction
    return of_skin


def motion_figures(poses: Sequence[Pose], footprint: Footprint) -> MotionFigures:
    """Extremes of a motion while the tool is below the undeformed surface.

    A tilted tool reaches deeper on one side, by its reach times the slope.
    """
    profile = _profile(poses, footprint)
    depths = [_reach(pose, footprint, profile) for pose in poses]
    touching = [i for i, depth in enumerate(depths) if depth > 0]
    if not touching:
        return MotionFigures(len(poses))
    reach = footprint.reach_mm(max(depths))
    lateral = turned = speed = step = step_aside = 0.0
    shortest = math.inf
    for (i, a), (j, b) in pairwise(enumerate(poses)):
        if depths[i] <= 0 and depths[j] <= 0:
            continue
        side, turn = math.hypot(b.x_mm - a.x_mm, b.y_mm - a.y_mm), abs(b.twist_deg - a.twist_deg)
        lateral, turned = lateral + side, turned + turn
        aside = side + math.radians(turn + _tilt(a, b)) * reach
        # Gel next to the tool is pushed down when the tool moves over it.
        deepest = max(depths[i], depths[j])
        pushed = min(deepest, footprint.steepest(deepest) * aside) if aside > 0 else 0.0
        way = math.hypot(aside, b.depth_mm - a.depth_mm) + pushed
        speed = max(speed, way / (b.time_s - a.time_s))
        step, step_aside = max(step, abs(depths[j] - depths[i])), max(step_aside, aside)
        shortest = min(shortest, b.time_s - a.time_s)
    return MotionFigures(
        poses=len(poses),
        depth_mm=max(depths),
        lateral_mm=lateral,
        twist_deg=turned,
        tilt_deg=max(math.hypot(p.tilt_x_deg, p.tilt_y_deg) for p in poses),
        contact_s=poses[-1].time_s - poses[max(0, touching[0] - 1)].time_s,
        speed_mm_s=speed,
        step_mm=step,
        step_aside_mm=step_aside,
        shortest_s=shortest if math.isfinite(shortest) else 0.0,
        recedes=any(b < a and a > 0 for a, b in pairwise(depths)),
    )


def _tilt(a: Pose, b: Pose) -> float:
    return math.hypot(b.tilt_x_deg - a.tilt_x_deg, b.tilt_y_deg - a.tilt_y_deg)


def _profile(poses: Sequence[Pose], footprint: Footprint) -> tuple[tuple[float, float], ...]:
    """Heights over the lowest point and the reach there; nothing where no pose is tilted."""
    if not any(pose.tilt_x_deg or pose.tilt_y_deg for pose in poses):
        return ()
    heights = (HIGHEST_MM * (k / LEVELS) ** 2 for k in range(1, LEVELS + 1))
    return tuple((height, footprint.reach_mm(height)) for height in heights)


def _reach(pose: Pose, footprint: Footprint, profile: tuple[tuple[float, float], ...]) -> float:
    slope = math.tan(math.radians(math.hypot(pose.tilt_x_deg, pose.tilt_y_deg)))
    reached = pose.depth_mm
    if slope == 0:
        return reached
    # Two passes, because the tilt may lower shapes that are raised.
    for _ in range(2):
        reached = pose.depth_mm + footprint.reach_mm(max(reached, JUST_TOUCHING_MM)) * slope
    # A round tool that has rolled touches beside its origin, which is above the gel then.
    lowered = max((reach * slope - height for height, reach in profile), default=0.0)
    return max(reached, pose.depth_mm + lowered / math.hypot(1.0, slope))


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
        least_light=_least_light(Path(path), manifest, positions),
        **_skin_figures(manifest.get("skin")),
    )


def _skin_figures(record: Mapping[str, Any] | None) -> dict[str, Any]:
    """The figures of coat and fabric in a manifest."""
    if record is None:
        return {}
    from ifem_export.elements.skin import Skin

    skin = Skin.from_record(record)
    return {"skin_n_per_mm": skin.stiffness_n_per_mm, "skin_friction": skin.friction}


def _least_light(folder: Path, manifest: Mapping[str, Any], positions_mm: Any) -> float:
    """The light on the darkest dot at rest, summed over the channels that the camera has."""
    import numpy as np

    from gelslim_optics.camera.record import is_mono
    from gelslim_optics.light.light_map import LIGHT_FIELDS, LightMap, red_green_sides

    if manifest.get("light"):
        files = {n: manifest["arrays"][f"light_{n}"]["file"] for n in LIGHT_FIELDS}
        light = LightMap.from_arrays({n: np.load(folder / file) for n, file in files.items()})
    else:
        cells, size = manifest["mesh"]["cells"], manifest["mesh"]["cell_size_mm"]
        length_mm, width_mm = (cells[k] * size[k] for k in (0, 1))
        light = red_green_sides(length_mm, width_mm, decay_mm=0.8 * width_mm)
    seen = light.at(positions_mm[:, 0], positions_mm[:, 1]) @ light.colour
    one_channel = is_mono(manifest["camera"])
    return float((seen[:, 0] if one_channel else seen.sum(axis=1)).min())


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
