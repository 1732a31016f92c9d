"""Specs near designs that can be built, so that a good share of them reaches CAD."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .ranges import LEAVES, TEXTS, Leaf, anywhere, short

RESOLUTIONS = ((320, 240), (640, 480), (800, 600), (1280, 720), (1600, 1200), (640, 640))
CABLE_RATIO = 0.6
"""Thickest round cable at an edge of the module over the module's depth, for most depths drawn."""
Values = dict[str, Any]


def near_default(rng: np.random.Generator, leaf: Leaf) -> Any:
    """The default of a field, or something about it."""
    if leaf.kind in ("choice", "bool"):
        return leaf.default if rng.random() < 0.5 else anywhere(rng, leaf)
    if leaf.kind == "text" and rng.random() < 0.3:
        return str(rng.choice(TEXTS))
    if leaf.kind in ("text", "list") or leaf.default is None:
        return list(leaf.default) if isinstance(leaf.default, tuple) else leaf.default
    if rng.random() < 0.6:
        return leaf.default
    value = leaf.default * math.exp(rng.normal(0, 0.2))
    value = min(max(value, leaf.low * 1.0001), leaf.high * 0.9999)
    if leaf.kind == "int":
        return round(value)
    return min(max(short(value, 3), leaf.low), leaf.high)


def plausible(rng: np.random.Generator) -> Values:
    """Field values by path: every field of the spec, camera and gel drawn to suit each other."""
    values: Values = {
        path: near_default(rng, leaf) for path, leaf in LEAVES.items() if not leaf.required
    }
    values |= _camera(rng) | _gel(rng) | _housing(rng, values) | _boards(rng)
    if values["camera.cable_kind"] == "round" and values["camera.cable_exit"] != "rear":
        most = CABLE_RATIO * values["camera.module_depth_mm"]
        values["camera.cable_width_mm"] = short(min(values["camera.cable_width_mm"], most), 3)
    return values


def _boards(rng: np.random.Generator) -> Values:
    """A supply that suits the driver, and current that the LED bears."""
    driven = bool(rng.random() < 0.3)
    return {
        "electronics.driver": "constant_current" if driven else "resistor",
        "electronics.supply_v": 60.0 if driven else float(rng.choice([5.0, 5.0, 12.0])),
        "electronics.current_ma": None,
    }


def _camera(rng: np.random.Generator) -> Values:
    width_px, height_px = RESOLUTIONS[int(rng.integers(len(RESOLUTIONS)))]
    width = short(rng.uniform(2.5, 5.5), 5)
    focal = short(width * rng.uniform(0.5, 1.05))
    module = short(rng.uniform(5, 10), 3)
    return {
        "camera.image_width_px": width_px,
        "camera.image_height_px": height_px,
        "camera.sensor_width_mm": width,
        "camera.sensor_height_mm": short(width * height_px / width_px, 8),
        "camera.focal_length_mm": focal,
        "camera.f_number": short(rng.uniform(2.4, 8), 2),
        "camera.focus_nearest_mm": float(rng.choice([10.0, 60.0, 1000.0])),
        "camera.lens_travel_mm": short(rng.uniform(0.5, 1.5) * focal**2 / 20, 3),
        "camera.module_width_mm": module,
        "camera.module_height_mm": short(min(module * rng.uniform(0.8, 1.1), 9), 3),
        "camera.lens_diameter_mm": short(module * rng.uniform(0.5, 0.9), 3),
        "camera.cable_width_mm": short(rng.uniform(3, 7), 3),
    }


def _gel(rng: np.random.Generator) -> Values:
    length, width = short(rng.uniform(12, 40), 3), short(rng.uniform(12, 36), 3)
    diameter = short(max(0.3, length / 45) * rng.uniform(0.9, 1.6), 3)
    pitch = short(diameter * rng.uniform(2.05, 3), 3)
    values: Values = {
        "design.gel.length_mm": length,
        "design.gel.width_mm": width,
        "design.gel.thickness_mm": short(rng.uniform(1.2, 4), 3),
        "design.gel.corner_radius_mm": short(rng.choice([0, 0.5, 2, 4]) * rng.uniform(0.8, 1), 3),
        "design.gel.crown_height_mm": float(rng.choice([0, 0, 0, 0.3, 0.6])),
        "design.markers.diameter_mm": diameter,
        "design.markers.pitch_mm": pitch,
        "material.gel.refractive_index": short(rng.uniform(1.38, 1.5), 4),
        "material.acrylic.refractive_index": short(rng.uniform(1.45, 1.6), 4),
        "material.gel.poissons_ratio": short(rng.uniform(0, 0.44), 3),
        "mesh.layers": int(rng.choice([1, 1, 2, 4])),
        "mesh.nodes_per_marker_pitch": int(rng.choice([1, 2, 2, 3])),
    }
    for path, side in (("design.markers.rows", length), ("design.markers.columns", width)):
        most = int((side - diameter) / pitch)
        values[path] = int(rng.integers(5, most + 1)) if most >= 5 and rng.random() < 0.2 else None
    if rng.random() < 0.3:
        values["mesh.cells_along"] = int(rng.integers(4, 40))
        values["mesh.cells_across"] = int(rng.integers(4, 40))
    return values


def _housing(rng: np.random.Generator, values: Values) -> Values:
    acrylic = values["manufacturing.acrylic_stock_mm"]
    guide = float(rng.choice([t for t in acrylic if 1.5 <= t <= 4]))
    shim = short(rng.uniform(1, 1.6), 3)
    return {
        "design.light_guide.thickness_mm": guide,
        "design.light_guide.bend_radius_ratio": short(rng.uniform(1.8, 3.5), 3),
        "design.light_guide.leg_length_mm": short(rng.uniform(1, 4), 3),
        "design.leds.package_mm": short(min(values["design.leds.package_mm"], guide - 0.4), 3),
        "design.leds.placement_tolerance_mm": 0.15,
        "design.mirror.thickness_mm": float(rng.choice(values["manufacturing.mirror_stock_mm"])),
        "design.optics.blur_per_diameter": short(rng.uniform(0.25, 0.5), 3),
        "design.optics.min_px_per_marker": short(rng.uniform(4, 7), 3),
        "design.housing.shim_thickness_mm": shim,
        "design.housing.precompression_mm": short(0.55 * shim, 3),
        "design.housing.baffle_mm": max(values["design.housing.baffle_mm"], 0.8),
        "design.housing.back_wall_mm": short(rng.uniform(1.2, 2), 3),
        "design.housing.tip_wall_mm": short(rng.uniform(4.7, 7), 3),
        "design.housing.screw": str(rng.choice(["M1.6", "M2", "M2"])),
        "manufacturing.acrylic_tolerance_ratio": 0.1,
        "tolerance.acrylic": "measured",
        "design.mount.tongue_thickness_mm": short(rng.uniform(3, 5), 3),
    }
