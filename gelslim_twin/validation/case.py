"""Contacts beside the paper's ball, scaled to the pad: rods both ways, a punch that turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gelslim_twin.scene.indenter import Cylinder, FlatPunch, Indenter
from gelslim_twin.scene.pose import Pose

STEPS = 3
DEPTH_SHARE = 0.15


@dataclass(frozen=True)
class Case:
    """A tool along poses; `known` is its shape as `gelslim force` takes it."""

    name: str
    indenter: Indenter
    poses: tuple[Pose, ...]
    known: str
    """Empty where the pipeline cannot tell the depth from the patch."""


def other_contacts(thickness_mm: float, length_mm: float, width_mm: float) -> tuple[Case, ...]:
    """Depths of 15 % of the gel, reached in three steps, then shear or twist in three."""
    depth = DEPTH_SHARE * thickness_mm
    radius = max(1.0, min(length_mm, width_mm) / 6)
    shear = 0.05 * thickness_mm
    punch = FlatPunch(shape="flat_punch", radius_mm=radius * 2 / 3)
    down = Pose(1.0, 0.0, 0.0, depth)
    known = f"cylinder:{radius:g}"
    # Rods reach over both rims: where they end is another question.
    along = Cylinder(shape="cylinder", radius_mm=radius, length_mm=2 * length_mm)
    across = Cylinder(shape="cylinder", radius_mm=radius, length_mm=2 * width_mm, axis_deg=90)
    return (
        Case("rod along, sheared across", along, path(down, Pose(2.0, 0.0, shear, depth)), known),
        Case("rod across, sheared along", across, path(down, Pose(2.0, shear, 0.0, depth)), known),
        Case("punch and twist", punch, path(down, Pose(2.0, 0.0, 0.0, depth, 3.0)), ""),
    )


def path(*ends: Pose) -> tuple[Pose, ...]:
    """From just over the first end's place through every end, three steps each."""
    first = ends[0]
    poses = [Pose(0.0, first.x_mm, first.y_mm, 0.0)]
    for end in ends:
        start = poses[-1]
        names = ("time_s", "x_mm", "y_mm", "depth_mm", "twist_deg")
        for part in np.linspace(0, 1, STEPS + 1)[1:]:
            blend = {n: (1 - part) * getattr(start, n) + part * getattr(end, n) for n in names}
            poses.append(Pose(**{n: float(v) for n, v in blend.items()}))
    return tuple(poses)
