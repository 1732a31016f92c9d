"""Fingers for the tests of solids: the shipped designs and random ones from fixed seeds."""

from __future__ import annotations

import itertools
import random
from functools import cache
from typing import Any

import pytest
from shipped_fingers import NAMES, dimensions
from shipped_fingers import parts as shipped_parts

from gelslim_cad.checks import check
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.part import Part
from gelslim_cad.spec import Spec

RANDOM = 6


def random_spec(seed: int) -> Spec:
    r = random.Random(seed)
    side = r.uniform(10, 45)
    module = r.uniform(5, 12)
    camera: dict[str, Any] = {
        "image_width_px": 640,
        "image_height_px": 480,
        "sensor_width_mm": 3.6288,
        "sensor_height_mm": 2.7216,
        "focal_length_mm": r.uniform(2.0, 3.6),
        "f_number": r.uniform(2.8, 5.6),
        "module_width_mm": module,
        "module_height_mm": r.uniform(5, 12),
        "module_depth_mm": r.uniform(3, 6),
        "lens_diameter_mm": module * r.uniform(0.4, 0.8),
        "lens_height_mm": r.uniform(0, 3),
        "lens_travel_mm": 2.0,
    }
    design: dict[str, Any] = {
        "gel": {
            "length_mm": side,
            "width_mm": min(45.0, max(10.0, side * r.uniform(0.8, 1.3))),
            "thickness_mm": r.uniform(1.2, 4),
            "corner_radius_mm": r.uniform(0, 4),
        },
        "light_guide": {
            "thickness_mm": r.uniform(1.5, 5),
            "bend_radius_ratio": r.uniform(0.8, 4),
        },
        "optics": {"blur_per_diameter": 1.0, "min_px_per_marker": 2.0, "max_keystone": 3.0},
        "mirror": {"thickness_mm": r.uniform(0.7, 2)},
        "housing": {"back_wall_mm": r.uniform(1.2, 3), "side_wall_mm": r.uniform(1.2, 3)},
    }
    return Spec(
        format="gelslim-spec/1",
        name=f"random{seed}",
        camera=camera,  # type: ignore[arg-type]
        design=design,  # type: ignore[arg-type]
    )


def screws_refused(d: Dimensions) -> list[str]:
    """Failed rules on plates, blocks and holes of the screws."""
    about = ("bezel.", "cover.", "screw.", "corner.", "mount.")
    return [c.id for c in check(d) if c.status == "fail" and c.id.startswith(about)]


FINGERS = [*NAMES, *(f"random{number}" for number in range(RANDOM))]


@cache
def random_fingers() -> tuple[Dimensions, ...]:
    """Dimensions of the first `RANDOM` random specs that can be assembled.

    Left out are those without a feasible fold and those whose screws a design rule refuses.
    """
    drawn = (derive(random_spec(seed)) for seed in itertools.count())
    built = (d for d in drawn if d.feasible() and not screws_refused(d))
    return tuple(itertools.islice(built, RANDOM))


def finger(name: str) -> Dimensions:
    """Dimensions of one of FINGERS, derived when they are first asked for."""
    return dimensions(name) if name in NAMES else random_fingers()[int(name[len("random") :])]


@cache
def parts_of(name: str) -> tuple[Part, ...]:
    from gelslim_cad.solids.finger import finger_parts

    return shipped_parts(name) if name in NAMES else finger_parts(finger(name))


def part(name: str, wanted: str) -> Part:
    return next(p for p in parts_of(name) if p.name == wanted)


LATER = (
    "gelslim2",
    "gelslim3_lens",
    "long50",
    "thin",
    "wide",
    *FINGERS[len(NAMES) :],
)
each_finger = pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow if n in LATER else ()) for n in FINGERS]
)
