"""Scenes as text, figures of a sensor, and random scenes from a seed."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import pytest

from gelslim_core.yaml.errors import InputError, Problem
from gelslim_twin.effects.circumstances import SensorFigures
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.question import plan_scene
from gelslim_twin.scene.reader import LoadedScene, read_scene

ROOT = Path(__file__).parents[2]
GALLERY = sorted((ROOT / "designs" / "scenes").glob("*.yaml"))

MINIMAL = """\
format: gelslim-scene/1
name: sample
sensor: {spec: finger.yaml}
indenters:
  - shape: sphere
    radius_mm: 8
motion:
  waypoints:
    - {move: press, depth_mm: 0.5}
observe: [force]
"""

SENSOR = SensorFigures(
    length_mm=28.0,
    width_mm=28.0,
    thickness_mm=2.0,
    youngs_modulus_mpa=0.147,
    poissons_ratio=0.3223,
    surface_nodes=1849,
    layers=4,
    markers=575,
    marker_pitch_mm=1.0,
    marker_diameter_mm=0.5,
    focal_px=634.9,
    image_width_px=640,
    image_height_px=480,
    near_mm=32.0,
    far_mm=40.5,
    half_view_px=364.0,
    tilt_deg=17.7,
    oblique_deg=43.0,
    layers_mm=((2.5, 1.4906), (2.0, 1.41)),
    aperture_mm=1.24,
    focus_mm=35.8,
)


def load(folder: Path, text: str) -> LoadedScene:
    path = folder / "scene.yaml"
    path.write_text(text, encoding="utf-8")
    return read_scene(path)


def problems(folder: Path, text: str) -> tuple[Problem, ...]:
    with pytest.raises(InputError) as caught:
        load(folder, text)
    return caught.value.problems


def plan_text(folder: Path, text: str) -> Plan:
    return plan_scene(load(folder, text), SENSOR)


SHAPES = (
    lambda r: {"shape": "sphere", "radius_mm": r.uniform(1, 20)},
    lambda r: {
        "shape": "cylinder",
        "radius_mm": r.uniform(1, 10),
        "length_mm": r.uniform(2, 30),
        "axis_deg": r.uniform(-90, 90),
    },
    lambda r: {"shape": "ring", "outer_radius_mm": r.uniform(4, 8), "inner_radius_mm": 3.0},
    lambda r: {"shape": "flat_punch", "radius_mm": r.uniform(1, 8)},
    lambda r: {"shape": "flat_punch", "length_mm": r.uniform(1, 9), "width_mm": r.uniform(1, 9)},
    lambda r: {
        "shape": "wedge",
        "included_angle_deg": r.uniform(30, 150),
        "length_mm": r.uniform(3, 20),
        "tip_radius_mm": r.choice([0.0, 0.5]),
    },
    lambda r: {"shape": "cone", "included_angle_deg": r.uniform(40, 150), "tip_radius_mm": 0.3},
    lambda r: {
        "shape": "textured_plane",
        "length_mm": r.uniform(5, 20),
        "width_mm": r.uniform(5, 20),
        "relief_mm": r.choice([0.0, 0.2, 1.0]),
        "texture": r.choice(["ridges", "bumps", "rough"]),
    },
)


def random_scene(seed: int) -> str:
    """A legal scene as YAML (JSON is YAML), every choice from `seed`."""
    import json

    r = random.Random(seed)
    moves: list[dict[str, Any]] = [{"move": "press", "depth_mm": r.uniform(-0.1, 1.2)}]
    for _ in range(r.randint(0, 3)):
        moves.append(
            r.choice(
                (
                    {"move": "shear", "x_mm": r.uniform(-1, 1), "y_mm": r.uniform(-1, 1)},
                    {"move": "slide", "y_mm": r.uniform(-10, 10), "steps": 20},
                    {"move": "twist", "angle_deg": r.uniform(-40, 40)},
                    {"move": "tilt", "about": r.choice("xy"), "angle_deg": r.uniform(-5, 5)},
                    {"move": "hold", "duration_s": r.uniform(0.1, 3)},
                    {"move": "release"},
                )
            )
        )
    observe = r.sample(["displacement", "force", "markers", "image"], r.randint(1, 4))
    scene: dict[str, Any] = {
        "format": "gelslim-scene/1",
        "name": f"random{seed}",
        "sensor": {"spec": "finger.yaml"},
        "indenters": [r.choice(SHAPES)(r) for _ in range(r.choice([1, 1, 2]))],
        "motion": {"waypoints": moves},
        "contact": {"friction": r.choice([0.0, 0.3, 1.0, 3.0])},
        "observe": observe,
        "tolerance": {
            "force_n": r.choice([0.0, 0.01, 0.1, 1.0, 10.0]),
            "image_px": r.choice([0.0, 0.02, 0.2, 2.0, 20.0]),
        },
        "effects": {
            "relaxation": {"terms": [{"fraction": 0.1, "time_s": r.uniform(0.1, 10)}]},
            "marker_print": {"jitter_mm": r.choice([0.0, 0.001, 0.02])},
            "compression": {"quality": r.randint(1, 95)},
            "sensor_noise": r.choice(["auto", "on", "off"]),
            "defocus": r.choice(["auto", "on"]),
        },
        "seed": seed,
    }
    return json.dumps(scene)
