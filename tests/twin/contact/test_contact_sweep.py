"""Every shape, Poisson's ratio and friction on a finer pad, along a path."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from contact_pads import small_pad

from gelslim_twin.contact.load_steps import even_steps
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import (
    Cone,
    Cylinder,
    FlatPunch,
    Indenter,
    Ring,
    Sphere,
    TexturedPlane,
    Wedge,
)
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance

SHAPES: dict[str, Indenter] = {
    "sphere": Sphere(shape="sphere", radius_mm=5),
    "cylinder": Cylinder(shape="cylinder", radius_mm=3, length_mm=8, axis_deg=30),
    "ring": Ring(shape="ring", outer_radius_mm=3.5, inner_radius_mm=2),
    "punch": FlatPunch(shape="flat_punch", length_mm=4, width_mm=3),
    "wedge": Wedge(shape="wedge", included_angle_deg=90, length_mm=30, tip_radius_mm=0.2),
    "cone": Cone(shape="cone", included_angle_deg=120, tip_radius_mm=0.2),
    "bumps": TexturedPlane(
        shape="textured_plane", length_mm=8, width_mm=8, texture="bumps", pitch_mm=3, relief_mm=0.3
    ),
}
PATH = (
    Pose(depth_mm=0.15), Pose(depth_mm=0.3), Pose(depth_mm=0.45), Pose(x_mm=0.6, depth_mm=0.45),
    Pose(x_mm=1.5, y_mm=0.5, depth_mm=0.45), Pose(x_mm=1.5, y_mm=0.5, depth_mm=0.45, twist_deg=15),
    Pose(x_mm=1.5, y_mm=0.5, depth_mm=0.4, twist_deg=15, tilt_x_deg=3),
    Pose(x_mm=0.5, y_mm=0.5, depth_mm=0.4, twist_deg=15, tilt_x_deg=3),
    Pose(x_mm=0.5, y_mm=0.5, depth_mm=-1.0),
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("poisson", [0.32, 0.49, 0.4999])
@pytest.mark.parametrize("friction", [0.0, 0.3, 1.0, 3.0])
def test_all_shapes_converge(poisson: float, friction: float) -> None:
    """In the middle, over an edge and over a corner of the pad."""
    kept = SurfaceCompliance(small_pad(poisson, 24, 4))
    for shape in SHAPES.values():
        for place in (0.0, 5.0):
            path = [
                Pose(
                    p.time_s, p.x_mm + place, p.y_mm + place, p.depth_mm, p.twist_deg, p.tilt_x_deg
                )
                for p in PATH
            ]
            one = ContactSolver(kept, Tool.of([shape], Path()), ContactSettings(1e-3, friction))
            states = list(one.states(tuple(path)))
            for pose, state in zip(path[:-1], states[:-1], strict=True):
                assert state.force_n.any(), pose
                assert state.solver["residual"] <= 1e-3
                assert state.solver["penetration_mm"] <= 2e-3
                # Pressed deeper, a tool pushes; held by friction, a flank may pull on its way up.
                if pose.depth_mm == 0.45 and friction <= 1:
                    assert state.force_n[:, 2].sum() < 0
            assert not states[-1].force_n.any()


@pytest.mark.slow
def test_friction_in_finer_and_finer_steps() -> None:
    """Forces along a press and a slide come together at first order."""
    kept = SurfaceCompliance(small_pad(0.49, 24, 4))
    fields = []
    for steps in (4, 8, 16, 32, 64):
        one = ContactSolver(
            kept, Tool.of([SHAPES["sphere"]], Path()), ContactSettings(1e-6, 0.5, longest_step=50.0)
        )
        down, side = Pose(depth_mm=0.5), Pose(x_mm=0.4, depth_mm=0.5)
        poses = (
            Pose(),
            *even_steps(Pose(), down, steps),
            *even_steps(down, side, steps),
        )
        fields.append(list(one.states(poses))[-1].force_n)
    size = np.linalg.norm(fields[-1])
    gaps = [np.linalg.norm(f - fields[-1]) / size for f in fields[:-1]]
    assert gaps[-1] < 0.02
    assert gaps[0] > gaps[1] > gaps[-1]
