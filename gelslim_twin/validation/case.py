"""Contacts that a validation tries, scaled to the pad."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gelslim_twin.scene.indenter import Cylinder, FlatPunch, Indenter, Sphere
from gelslim_twin.scene.pose import Pose

STEPS = 6
FRICTION = 0.8


@dataclass(frozen=True)
class Case:
    """A tool along poses; `known` is its shape as `gelslim force` takes it."""

    name: str
    indenter: Indenter
    poses: tuple[Pose, ...]
    known: str
    """Empty where the pipeline cannot tell the depth from the patch."""


def standard_cases(thickness_mm: float, length_mm: float, width_mm: float) -> tuple[Case, ...]:
    """Press, press with shear, twist, rod: depths of 15 % of the gel, reached in six steps."""
    depth = 0.15 * thickness_mm
    radius = max(2.0, min(length_mm, width_mm) / 3)
    aside = 0.12 * length_mm
    ball = Sphere(shape="sphere", radius_mm=radius)
    rod = Cylinder(shape="cylinder", radius_mm=radius / 2, length_mm=2 * length_mm)
    punch = FlatPunch(shape="flat_punch", radius_mm=radius / 3)
    down = Pose(1.0, 0.0, 0.0, depth)
    side = Pose(1.0, aside, -aside / 2, depth)
    return (
        Case("press", ball, path(down), f"sphere:{radius:g}"),
        Case(
            "press aside and shear",
            ball,
            path(side, Pose(2.0, aside + 0.1, -aside / 2 + 0.06, depth)),
            f"sphere:{radius:g}",
        ),
        Case(
            "rod and shear", rod, path(down, Pose(2.0, 0.0, 0.1, depth)), f"cylinder:{radius / 2:g}"
        ),
        Case("punch and twist", punch, path(down, Pose(2.0, 0.0, 0.0, depth, 3.0)), ""),
    )


def path(*ends: Pose) -> tuple[Pose, ...]:
    """From just over the first end's place through every end, six steps each."""
    first = ends[0]
    poses = [Pose(0.0, first.x_mm, first.y_mm, 0.0)]
    for end in ends:
        start = poses[-1]
        names = ("time_s", "x_mm", "y_mm", "depth_mm", "twist_deg")
        for part in np.linspace(0, 1, STEPS + 1)[1:]:
            blend = {n: (1 - part) * getattr(start, n) + part * getattr(end, n) for n in names}
            poses.append(Pose(**{n: float(v) for n, v in blend.items()}))
    return tuple(poses)
