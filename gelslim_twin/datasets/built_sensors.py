"""Built sensors of a data set: each has its own gel, camera, print and blemishes.

Poisson's ratio and thickness need a compliance of their own, and the place of the camera needs a
picture of the untouched gel. So they are drawn for a small number of sensors, each of which a
worker prepares once, and every sample is of one of them.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.scene.distribution import NORMAL_RANGE_SIGMA, Range, hashed, share_of, value_at
from gelslim_twin.scene.draw import sensors_of
from gelslim_twin.scene.scene import Scene
from gelslim_twin.scene.variation import VariedGel
from gelslim_twin.simulation.sensor import TwinSensor
from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BuiltSensor:
    """One built sensor.

    Attributes:
        number: Its number, from 0.
        seed: Seed of its coat, print, dirt and reflections.
        poissons_ratio: Poisson's ratio of its gel.
        thickness_factor: Thickness of its gel over that of the design.
        camera: Displacement of its camera by name of `vary.camera`.
    """

    number: int
    seed: int
    poissons_ratio: float
    thickness_factor: float = 1.0
    camera: Mapping[str, float] = field(default_factory=dict)

    def of(self, design: TwinSensor) -> TwinSensor:
        """The sensor as built; that of the design itself where nothing differs."""
        bundle = design.bundle
        material = bundle.material
        ratio = self.thickness_factor
        if (self.poissons_ratio, ratio) != (material.poissons_ratio, 1.0):
            gel = replace(material, poissons_ratio=self.poissons_ratio)
            bundle = bundle.with_gel(gel, ratio)
        if ratio != 1.0 or any(self.camera.values()):
            grown_mm = (ratio - 1.0) * thickness_mm(design.bundle)
            bundle = replace(bundle, camera=moved_camera(bundle.camera, self.camera, grown_mm))
        return design if bundle is design.bundle else TwinSensor(bundle)


def thickness_mm(bundle: Bundle) -> float:
    """Thickness of the gel of a bundle."""
    return float(bundle.mesh.layers * bundle.mesh.cell_size_mm[2])


def built_sensors(scene: Scene, bundle: Bundle) -> tuple[BuiltSensor, ...]:
    """The built sensors of a data set, the same on every machine."""
    ranges, seed = gel_ranges(scene.vary.gel, bundle), scene.seed
    count = sensors_of(scene.vary, bool({"poissons_ratio", "thickness_factor"} & set(ranges)))
    found = []
    for number in range(count):
        shares = {n: share_of(seed, "sensor", number, "gel", n) for n in ranges}
        gel = {n: value_at(given, shares[n]) for n, given in ranges.items()}
        camera = {
            name: value_at(given, share_of(seed, "sensor", number, "camera", name))
            for name, given in scene.vary.camera.ranges()
        }
        found.append(
            BuiltSensor(
                number,
                hashed(seed, "sensor", number),
                gel.get("poissons_ratio", bundle.material.poissons_ratio),
                gel.get("thickness_factor", 1.0),
                camera,
            )
        )
    return tuple(found)


def gel_ranges(gel: VariedGel, bundle: Bundle) -> dict[str, Range]:
    """Ranges of the gel by name: those of the scene, and else the tolerances of the bundle."""
    found: dict[str, Range] = dict(gel.ranges())
    if not gel.within_tolerance:
        return found
    material, wide = bundle.material, NORMAL_RANGE_SIGMA
    young = bundle.tolerances.get("youngs_modulus_mpa", 0.0) / material.youngs_modulus_mpa
    poisson = bundle.tolerances.get("poissons_ratio", 0.0)
    thick = bundle.tolerances.get("thickness_mm", 0.0) / thickness_mm(bundle)
    for name, middle, sigma in (
        ("youngs_modulus_factor", 1.0, young),
        ("poissons_ratio", material.poissons_ratio, poisson),
        ("thickness_factor", 1.0, thick),
    ):
        if sigma > 0 and name not in found:
            low, high = middle - wide * sigma, middle + wide * sigma
            if name == "poissons_ratio":
                high = min(high, 0.499)
            found[name] = (low, high, "normal")
    return found


def moved_camera(
    record: Mapping[str, Any], moved: Mapping[str, float], grown_mm: float
) -> dict[str, Any]:
    """The record of a camera that is displaced, behind a gel that is thicker.

    Args:
        record: The camera's record in a bundle.
        moved: Displacement by name of `vary.camera`.
        grown_mm: How much thicker the gel is; its outer surface stays at z = 0, so that window and
            camera move away from it.
    """
    found = copy.deepcopy(dict(record))
    shift = [moved.get("along_mm", 0.0), moved.get("across_mm", 0.0)]
    away = moved.get("away_mm", 0.0) + grown_mm
    x, y, z = found["position_mm"]
    found["position_mm"] = [x + shift[0], y + shift[1], z - away]
    found["window_bottom_z_mm"] = found["window_bottom_z_mm"] - grown_mm
    layers = [dict(layer) for layer in found["layers"]]
    layers[-1]["thickness_mm"] += grown_mm
    found["layers"] = layers
    axes = {name: np.array(found[name], dtype=float) for name in ("right", "down", "forward")}
    for name, axis in (("turn_deg", "forward"), ("nod_deg", "right"), ("pan_deg", "down")):
        if moved.get(name):
            turn = _turn(axes[axis], math.radians(moved[name]))
            axes = {key: turn @ value for key, value in axes.items()}
    return found | {name: value.tolist() for name, value in axes.items()}


def _turn(axis: Array, angle: float) -> Array:
    """Rotation matrix (3, 3) about a unit vector (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross)
