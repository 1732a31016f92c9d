"""Specs for the tests of gel and tooling: the paper's sensor, variants of it, random ones."""

from __future__ import annotations

import math
import random
from pathlib import Path
from typing import Any

from gelslim_cad.checks import check
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import read_spec
from ifem_export.markers.grid import MarkerGrid, build_marker_grid

DESIGNS = Path(__file__).parents[2] / "designs"
PINNED_GEL = {
    "length_mm": 28.0,
    "width_mm": 28.0,
    "thickness_mm": 2.0,
    "corner_radius_mm": 2.0,
    "crown_height_mm": 0.0,
}


def gelslim2(**changes: Any) -> Dimensions:
    """The paper's sensor with fields changed: `design__gel__length_mm=30`.

    The gel is pinned to 28 x 28 x 2 mm with R2 corners, for volumes worked by hand.
    """
    data = read_spec(DESIGNS / "gelslim2.yaml").spec.model_dump()
    data["design"]["gel"] = PINNED_GEL.copy()
    for path, value in changes.items():
        *blocks, name = path.split("__")
        block = data
        for key in blocks:
            block = block[key]
        block[name] = value
    return derive(Spec(**data))


def clipped_grid(d: Dimensions) -> MarkerGrid:
    grid = build_marker_grid(
        int(d["marker_grid.rows"]),
        int(d["marker_grid.columns"]),
        d["design.markers.pitch_mm"],
        d["design.markers.diameter_mm"],
        d["design.markers.anchors"],
    )
    return grid.clipped(GelShape.of(d).outline.contains)


def random_dimensions(seed: int) -> Dimensions:
    """A legal spec drawn over the whole range, its ends drawn often."""
    r = random.Random(seed)

    def draw(low: float, high: float) -> float:
        return r.choice([low, high, r.uniform(low, high), r.uniform(low, high)])

    length, width = draw(5, 120), draw(5, 120)
    half = min(length, width) / 2
    module, sensor = draw(1, 60), r.uniform(0.5, 10)
    camera = {
        "image_width_px": 640,
        "image_height_px": 480,
        "sensor_width_mm": sensor,
        "sensor_height_mm": 0.75 * sensor,
        "focal_length_mm": r.uniform(0.5, 10),
        "f_number": 2.8,
        "module_width_mm": module,
        "module_height_mm": draw(1, 20),
        "module_depth_mm": draw(0.5, 10),
        "lens_diameter_mm": max(0.5, r.choice([module, module * r.uniform(0.1, 1)])),
        "lens_height_mm": draw(0, 10),
        "cable_width_mm": draw(0.1, 60),
    }
    design = {
        "gel": {
            "length_mm": length,
            "width_mm": width,
            "thickness_mm": draw(0.3, 15),
            "corner_radius_mm": r.choice([0, half, r.uniform(0, half)]),
            "crown_height_mm": r.choice([0, draw(1e-6, 5)]),
        },
        "markers": {
            "pitch_mm": max(0.8, math.sqrt(length * width / 400)),
            "diameter_mm": 0.4,
            "edge_margin_mm": 0,
            "anchors": "none",
        },
        "light_guide": {"thickness_mm": draw(0.5, 10), "bend_radius_ratio": draw(0.1, 20)},
        "housing": {
            "side_wall_mm": draw(0.4, 10),
            "tip_wall_mm": draw(2, 30),
            "fit_clearance_mm": draw(0.02, 2),
            "gel_proud_mm": draw(0, 10),
            "corner_radius_mm": draw(0, 20),
            "screw": r.choice(["M1.6", "M2", "M2.5"]),
        },
    }
    manufacturing = {
        "mould_process": r.choice(["acrylic", "sla", "fdm", "aluminium"]),
        "print_process": r.choice(["sla", "fdm", "sls"]),
        "gel_shrinkage_percent": draw(0, 10),
        "acrylic_stock_mm": r.choice([(1.0,), (3.0, 5.0), (50.0,)]),
        "acrylic_tolerance_ratio": draw(0, 0.5),
    }
    spec = {
        "format": "gelslim-spec/1",
        "name": f"random{seed}",
        "camera": camera,
        "design": design,
        "manufacturing": manufacturing,
    }
    d = derive(Spec(**spec))
    if {"bezel.thickness_mm", "corner.screw_mm"} & {c.id for c in check(d) if c.status == "fail"}:
        # No such bezel is built; a printed one has no blank, which would be tooling.
        design["housing"]["bezel_material"] = "printed"
        d = derive(Spec(**spec))
    return d
