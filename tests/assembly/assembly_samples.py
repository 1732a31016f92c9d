"""Fingers for the tests of the assembly: shipped designs, by name."""

from __future__ import annotations

import random
from functools import cache
from typing import Any, get_args

from shipped_fingers import DESIGNS, NAMES, dimensions, parts

from gelslim_cad.assembly.bodies import Bodies, bodies, part_meshes
from gelslim_cad.assembly.finger_order import finger_order, tail_x_mm
from gelslim_cad.assembly.order import Step
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.export.mesh import TriangleMesh
from gelslim_cad.geometry.part import Part
from gelslim_cad.spec import Spec
from gelslim_cad.spec.gripper_library import GripperName
from gelslim_cad.spec.reader import read_spec
from gelslim_cad.tolerance.plan import with_values


def changed(name: str, **values: Any) -> Dimensions:
    """A design with other values; two underscores stand for a dot."""
    spec = read_spec(DESIGNS[NAMES.index(name)]).spec
    return derive(with_values(spec, {k.replace("__", "."): v for k, v in values.items()}))


def parts_of(d: Dimensions) -> tuple[Part, ...]:
    from gelslim_cad.solids.finger import finger_parts

    return finger_parts(d)


def order(d: Dimensions, made: tuple[Part, ...]) -> tuple[Step, ...]:
    return finger_order(d, [p.name for p in made])


def meshes(d: Dimensions, made: tuple[Part, ...]) -> Bodies:
    return bodies(part_meshes(made), tail_x_mm(d))


@cache
def drawn(name: str) -> dict[str, TriangleMesh]:
    return part_meshes(parts(name))


@cache
def meshes_of(name: str) -> Bodies:
    return meshes(dimensions(name), parts(name))


def random_spec(seed: int) -> Spec:
    """A spec with random camera, gel, housing, cable, threads and gripper."""
    r = random.Random(seed)
    side, module = r.uniform(12, 40), r.uniform(5, 11)
    kind = r.choice(("flat", "flat", "round"))
    camera = {
        "image_width_px": 640,
        "image_height_px": 480,
        "sensor_width_mm": 3.6288,
        "sensor_height_mm": 2.7216,
        "focal_length_mm": r.uniform(2.0, 3.4),
        "f_number": r.uniform(2.8, 5.6),
        "module_width_mm": module,
        "module_height_mm": r.uniform(5, 11),
        "module_depth_mm": r.uniform(3, 6),
        "lens_diameter_mm": module * r.uniform(0.4, 0.8),
        "lens_height_mm": r.uniform(0, 3),
        "lens_travel_mm": 2.0,
        "cable_kind": kind,
        "cable_exit": r.choice(("rear", "rear", "bottom", "top")),
        "cable_width_mm": 2.0 if kind == "round" else r.uniform(2.0, 0.9 * module),
        "cable_bend_radius_mm": r.uniform(1.0, 3.0),
    }
    design = {
        "gel": {
            "length_mm": side,
            "width_mm": min(42.0, side * r.uniform(0.85, 1.25)),
            "thickness_mm": r.uniform(1.2, 4),
            "corner_radius_mm": r.uniform(0, 4),
        },
        "light_guide": {"thickness_mm": r.uniform(1.5, 4), "bend_radius_ratio": r.uniform(0.8, 3)},
        "optics": {"blur_per_diameter": 1.0, "min_px_per_marker": 2.0, "max_keystone": 3.0},
        "mirror": {"thickness_mm": r.uniform(0.7, 2)},
        "housing": {
            "back_wall_mm": r.uniform(1.2, 3),
            "side_wall_mm": r.uniform(1.2, 3),
            "thread": r.choice(("insert", "nut", "self_cut")),
            "camera_seat": r.choice(("preloaded", "loose")),
            "bezel_material": r.choice(("printed", "steel")),
        },
        "mount": {"gripper": r.choice(get_args(GripperName))},
    }
    return Spec.model_validate(
        {
            "format": "gelslim-spec/1",
            "name": f"random{seed}",
            "camera": camera,
            "design": design,
        }
    )
