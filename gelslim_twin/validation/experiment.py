"""Contacts of a validation: the paper's ball that presses and slides, two rods and a punch."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gelslim_twin.scene.indenter import Cylinder, FlatPunch, Indenter, Sphere
from gelslim_twin.scene.pose import Pose

FRICTION = 0.8
DIRECTIONS = 8
PRESS_STEPS, SLIDE_STEPS = 3, 4
DEPTH_SHARES = 0.15, 0.30
"""Least and largest depth over the gel's thickness."""
RADIUS_SHARE, MOST_RADII = 0.36, 5.0
"""The ball's radius over the pad's shorter side, and at most over the gel's thickness."""
SLIDE_SHARE = 0.35
"""Slide over the gel's thickness: by then the whole contact slips."""
PLACE_SHARE = 0.12
"""Farthest start from the middle over the pad's shorter side."""
_GOLDEN_RAD = math.pi * (3 - math.sqrt(5))
_STRIDE = 3


@dataclass(frozen=True)
class SlideTest:
    """One press with the slide after it."""

    x_mm: float
    y_mm: float
    depth_mm: float
    direction_deg: float
    distance_mm: float

    @property
    def poses(self) -> tuple[Pose, ...]:
        """Poses from first contact: pressed in equal steps, then slid in equal steps."""
        turn = math.radians(self.direction_deg)
        pressed = [
            Pose(float(k), self.x_mm, self.y_mm, self.depth_mm * k / PRESS_STEPS)
            for k in range(PRESS_STEPS + 1)
        ]
        ways = [self.distance_mm * k / SLIDE_STEPS for k in range(1, SLIDE_STEPS + 1)]
        slid = [
            Pose(
                PRESS_STEPS + k,
                self.x_mm + way * math.cos(turn),
                self.y_mm + way * math.sin(turn),
                self.depth_mm,
            )
            for k, way in enumerate(ways, 1)
        ]
        return (*pressed, *slid)


@dataclass(frozen=True)
class Experiment:
    """A ball and its slides."""

    ball: Sphere
    tests: tuple[SlideTest, ...]

    @property
    def known(self) -> str:
        """The ball as an argument of `gelslim force`."""
        return f"sphere:{self.ball.radius_mm:g}"


def sphere_experiment(thickness_mm: float, length_mm: float, width_mm: float) -> Experiment:
    """Slides in eight directions, each from another place and depth, scaled to the pad.

    Depths go from 15 to 30 % of the gel's thickness, places lie on a sunflower about the middle,
    and neighbouring directions do not get neighbouring depths.
    """
    side = min(length_mm, width_mm)
    radius = round(min(RADIUS_SHARE * side, MOST_RADII * thickness_mm), 3)
    low, high = DEPTH_SHARES
    tests = []
    for k in range(DIRECTIONS):
        out = PLACE_SHARE * side * math.sqrt((k + 0.5) / DIRECTIONS)
        share = low + (high - low) * k / (DIRECTIONS - 1)
        tests.append(
            SlideTest(
                x_mm=out * math.cos(k * _GOLDEN_RAD),
                y_mm=out * math.sin(k * _GOLDEN_RAD),
                depth_mm=share * thickness_mm,
                direction_deg=360.0 / DIRECTIONS * (_STRIDE * k % DIRECTIONS),
                distance_mm=SLIDE_SHARE * thickness_mm,
            )
        )
    return Experiment(Sphere(shape="sphere", radius_mm=radius), tuple(tests))


STEPS = 3
DEPTH_SHARE = 0.15


@dataclass(frozen=True)
class Case:
    """A tool with its poses; `known` is its shape as an argument of `gelslim force`."""

    name: str
    indenter: Indenter
    poses: tuple[Pose, ...]
    known: str
    """Empty where the contact patch does not determine the depth."""


def other_contacts(thickness_mm: float, length_mm: float, width_mm: float) -> tuple[Case, ...]:
    """Depths of 15 % of the gel, reached in three steps, then shear or twist in three."""
    depth = DEPTH_SHARE * thickness_mm
    radius = max(1.0, min(length_mm, width_mm) / 6)
    shear = 0.05 * thickness_mm
    punch = FlatPunch(shape="flat_punch", radius_mm=radius * 2 / 3)
    down = Pose(1.0, 0.0, 0.0, depth)
    known = f"cylinder:{radius:g}"
    # The rods are longer than the pad, so that their ends do not press into it.
    along = Cylinder(shape="cylinder", radius_mm=radius, length_mm=2 * length_mm)
    across = Cylinder(shape="cylinder", radius_mm=radius, length_mm=2 * width_mm, axis_deg=90)
    return (
        Case("rod along, sheared across", along, path(down, Pose(2.0, 0.0, shear, depth)), known),
        Case("rod across, sheared along", across, path(down, Pose(2.0, shear, 0.0, depth)), known),
        Case("punch and twist", punch, path(down, Pose(2.0, 0.0, 0.0, depth, 3.0)), ""),
    )


def path(*ends: Pose) -> tuple[Pose, ...]:
    """Poses from first contact above the first end through all ends, three steps each."""
    first = ends[0]
    poses = [Pose(0.0, first.x_mm, first.y_mm, 0.0)]
    for end in ends:
        start = poses[-1]
        names = ("time_s", "x_mm", "y_mm", "depth_mm", "twist_deg")
        for part in np.linspace(0, 1, STEPS + 1)[1:]:
            blend = {n: (1 - part) * getattr(start, n) + part * getattr(end, n) for n in names}
            poses.append(Pose(**{n: float(v) for n, v in blend.items()}))
    return tuple(poses)
