"""Designs without tolerances, or with some of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import read_spec
from gelslim_cad.tolerance.plan import with_values

DESIGNS = Path(__file__).parents[2] / "designs"
NAMES = sorted(path.stem for path in DESIGNS.glob("*.yaml"))
NONE: dict[str, Any] = {
    "design.housing.camera_play_mm": 0.0,
    "design.leds.placement_tolerance_mm": 0.0,
    "manufacturing.print_tolerance_mm": 0.0,
    "manufacturing.gel_thickness_tolerance_mm": 0.0,
    "material.gel.youngs_modulus_tolerance_ratio": 0.0,
    "material.gel.poissons_ratio_tolerance": 0.0,
    "tolerance.acrylic": "measured",
    **{
        f"tolerance.{name}": 0.0
        for name in (
            "print_flatness_mm", "mirror_thickness_mm", "acrylic_measured_mm", "gel_place_mm",
            "shrinkage_percent", "marker_scale_percent", "marker_jitter_mm", "marker_place_mm",
            "focal_length_percent", "lens_turn", "lens_centring_mm", "entrance_pupil_mm",
            "led_flux_percent", "calibration_scale_percent", "alignment_px",
        )
    },
}  # fmt: skip
"""Every cause switched off."""


UNPREPARED = {
    "tolerance.adjusted": False,
    "tolerance.acrylic": "as_bought",
    "design.optics.image_margin": 0.015,
    "design.mirror.border_mm": 0.8,
    "design.mirror.thickness_mm": 1.0,
}
"""The shipped designs before they were made to have their yield."""


def spec(name: str, **values: Any) -> Spec:
    """A design made without a thought of its yield, with other values; `__` stands for a dot."""
    changed = {path.replace("__", "."): value for path, value in values.items()}
    return with_values(read_spec(DESIGNS / f"{name}.yaml").spec, {**UNPREPARED, **changed})


def exact(name: str, **values: Any) -> Spec:
    """A design without any error but those that `values` switch on."""
    return with_values(spec(name), {**NONE, **{k.replace("__", "."): v for k, v in values.items()}})


def drawn(names: dict[str, tuple[str, float]], count: int, seed: int) -> dict[str, NDArray]:
    """Errors drawn by numpy from distribution and spread by name."""
    rng = np.random.default_rng(seed)
    draw = {
        "uniform": lambda s: rng.uniform(-s, s, count),
        "normal": lambda s: rng.normal(0, s, count),
        "triangular": lambda s: s * (rng.random(count) - rng.random(count)),
    }
    return {name: draw[kind](spread) for name, (kind, spread) in names.items()}
