"""Contacts of a validation, and the gel on which they are solved.

The contacts are the paper's ball that presses and slides, two rods and a punch. The gel is finer
than that of the pipeline, of other elements, and neo-Hookean where its pad allows it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.load_steps import even_steps
from gelslim_twin.contact.nonlinear import NonlinearContact, unfit
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import Cylinder, FlatPunch, Indenter, Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.mesh.pad_mesh import PadMesh

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
STEPS, DEPTH_SHARE = 3, 0.15
"""Of the other contacts: steps of a movement, and depth over the gel's thickness."""
LAYERS = 8
"""Layers of cells of the gel behind the frames."""
Law = Literal["neo_hookean", "linear"]


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
        touch = Pose(0.0, self.x_mm, self.y_mm, 0.0)
        down = replace(touch, time_s=PRESS_STEPS, depth_mm=self.depth_mm)
        end = replace(
            down,
            time_s=PRESS_STEPS + SLIDE_STEPS,
            x_mm=self.x_mm + self.distance_mm * math.cos(turn),
            y_mm=self.y_mm + self.distance_mm * math.sin(turn),
        )
        return (touch, *even_steps(touch, down, PRESS_STEPS), *even_steps(down, end, SLIDE_STEPS))


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
    poses = [Pose(0.0, ends[0].x_mm, ends[0].y_mm, 0.0)]
    for end in ends:
        poses += even_steps(poses[-1], end, STEPS)
    return tuple(poses)


@dataclass(frozen=True, eq=False)
class TruthGel:
    """Solves contacts with friction on the finer pad; its compliance is stored in `folder`."""

    sensor: Bundle
    friction: float
    folder: Path | None = None
    _solvers: dict[Indenter, ContactSolver] = field(default_factory=dict, repr=False)

    @cached_property
    def compliance(self) -> SurfaceCompliance:
        """Surface compliance of the finer pad in its skin."""
        return SurfaceCompliance(truth_pad(self.sensor), self.folder, self.sensor.membranes)

    @property
    def law(self) -> Law:
        """Neo-Hookean for flat pads of whole cells, linear for the others."""
        return "neo_hookean" if unfit(self.sensor) is None else "linear"

    @property
    def layers(self) -> int:
        """Layers of the finer pad."""
        return self.compliance.bundle.mesh.layers

    def states(self, tool: Indenter, poses: tuple[Pose, ...], law: Law) -> list[GelState]:
        """A state per pose. Raises ContactError."""
        if tool not in self._solvers:
            settings = ContactSettings(friction=self.friction)
            body = Tool.of((tool,), Path())
            self._solvers[tool] = ContactSolver(self.compliance, body, settings)
        contact: Any = self._solvers[tool]
        if law == "neo_hookean":
            contact = NonlinearContact(contact)
        return list(contact.states(poses))


def truth_pad(bundle: Bundle) -> Bundle:
    """The bundle's pad in eight layers of B-bar cells on the same surface nodes.

    Crowned or weighted pads come back as they are: their layers are not free to choose.
    """
    mesh = bundle.mesh
    if unfit(bundle) is not None or mesh.layers >= LAYERS:
        return bundle
    hx, hy, hz = mesh.cell_size_mm
    plan = np.asarray(mesh.occupancy)[:, :, :1]
    cells = np.ascontiguousarray(np.repeat(plan, LAYERS, axis=2))
    finer = PadMesh.from_occupancy(cells, (hx, hy, hz * mesh.layers / LAYERS), mesh.origin_mm)
    made = build_bundle(finer, bundle.material, "bbar", with_stiffness=False)
    return replace(made, camera=bundle.camera, spec_hash=bundle.spec_hash)
