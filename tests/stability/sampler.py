"""Random specs from a seed: plausible designs with a share of extreme values."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from gelslim_cad.spec import Spec

CAMERAS = (
    {"sensor_width_mm": 3.6288, "sensor_height_mm": 2.7216, "focal_length_mm": 3.6},
    {"sensor_width_mm": 3.6288, "sensor_height_mm": 2.7216, "focal_length_mm": 1.9},
    {"sensor_width_mm": 2.4, "sensor_height_mm": 1.8, "focal_length_mm": 2.2},
    {"sensor_width_mm": 6.4, "sensor_height_mm": 4.8, "focal_length_mm": 4.0},
)


def random_spec(seed: int, index: int) -> dict[str, Any]:
    """The spec number `index` of a seed, as plain data; legal or nearly so."""
    rng = np.random.default_rng([seed, index])

    def between(low: float, high: float) -> float:
        return round(float(rng.uniform(low, high)), 3)

    def pick(*choices: Any) -> Any:
        return choices[int(rng.integers(len(choices)))]

    diameter = between(0.3, 1.2)
    thickness = pick(1.5, 2.0, 2.5, 3.0)
    wild = rng.random() < 0.25
    length, width = (between(6, 80), between(6, 80)) if wild else (between(12, 36), between(12, 36))
    return {
        "format": "gelslim-spec/1",
        "name": f"random_{seed}_{index}",
        "camera": {
            **pick(*CAMERAS),
            "image_width_px": pick(640, 800, 1280),
            "image_height_px": 0,
            "f_number": pick(2.0, 2.9, 4.0, 8.0),
            "lens_travel_mm": between(0.4, 2.0),
            "module_width_mm": between(6.5, 10),
            "module_height_mm": between(5, 10),
            "module_depth_mm": between(2.5, 7),
            "lens_diameter_mm": between(3, 6),
            "lens_height_mm": between(0, 3),
        },
        "design": {
            "gel": {
                "length_mm": length,
                "width_mm": width,
                "thickness_mm": between(1.5, 4),
                "corner_radius_mm": between(0, min(length, width) / 2 if wild else 3),
                "crown_height_mm": pick(0.0, 0.0, 0.0, 0.3),
            },
            "light_guide": {
                "thickness_mm": thickness,
                "bend_radius_ratio": between(0.6, 5),
                "leg_length_mm": between(0.5, 5),
                "end_support_mm": between(1, 4),
            },
            "leds": {"package_mm": round(thickness - 0.5, 3), "max_pitch_mm": between(3, 8)},
            "markers": {
                "diameter_mm": diameter,
                "pitch_mm": round(diameter * float(rng.uniform(2.0, 3.0)) + 0.001, 3),
                "anchors": pick("odd_sized", "omitted"),
            },
            "housing": {
                "side_wall_mm": between(1, 3),
                "back_wall_mm": between(1.2, 3),
                "tip_wall_mm": between(4.6, 9),
                "corner_radius_mm": between(0, 4),
                "screw": pick("M1.6", "M2"),
            },
            "mount": {"bolt": pick("M2", "M2.5", "M3"), "tongue_thickness_mm": between(3, 6)},
        },
        "manufacturing": {
            "print_process": pick("sla", "fdm", "sls"),
            "mould_process": pick("acrylic", "sla", "fdm", "aluminium"),
        },
        "mesh": {"layers": pick(1, 2, 4)},
    }


@dataclass(frozen=True)
class Sample:
    """One random spec with the seed and index that make it again."""

    seed: int
    index: int
    kind: str
    content: dict[str, Any]

    @property
    def spec(self) -> Spec:
        """The checked spec."""
        return Spec.model_validate(self.content)

    @property
    def text(self) -> str:
        """The spec as YAML (JSON is YAML)."""
        return json.dumps(self.content, indent=1)


def sample(seed: int, index: int) -> Sample:
    """Spec number `index` of a seed, with square pixels."""
    content = random_spec(seed, index)
    camera = content["camera"]
    ratio = camera["sensor_height_mm"] / camera["sensor_width_mm"]
    camera["image_height_px"] = round(camera["image_width_px"] * ratio)
    return Sample(seed, index, "plausible", content)
