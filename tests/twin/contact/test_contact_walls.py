"""Tools of several shapes have walls: one stands beside another at another height."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from agreement import Trial
from contact_pads import small_pad
from random_contact_scenes import random_contact
from sampled import quick

from gelslim_twin.contact.nonlinear import NonlinearContact
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import Cone, Cylinder, FlatPunch, Indenter, Ring
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance

PUNCH = FlatPunch(shape="flat_punch", length_mm=4, width_mm=4)
CONE = Cone(shape="cone", included_angle_deg=60, tip_radius_mm=2.0)
RING = Ring(
    shape="ring", outer_radius_mm=4.1, inner_radius_mm=3.6, x_mm=-0.7, y_mm=-3.6, raised_mm=0.07
)
AROUND = 0.6 * np.stack([g.ravel() for g in np.meshgrid(*2 * (np.linspace(-1, 1, 61),))], axis=1)
"""Places (m, 2) about a node, within what the gel moves in a step."""
STEPPED: dict[str, tuple[Indenter, ...]] = {
    "ring on cone": (CONE, RING),
    "low step": (
        PUNCH,
        FlatPunch(shape="flat_punch", length_mm=3, width_mm=8, x_mm=3.5, raised_mm=0.05),
    ),
    "rod's end": (
        CONE,
        Cylinder(shape="cylinder", radius_mm=2, length_mm=7, x_mm=0.5, y_mm=2.7, raised_mm=0.05),
    ),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("walls")


@pytest.mark.parametrize("raised", [0.003, 0.05, 4.0, None])
@pytest.mark.parametrize("pose", [Pose(depth_mm=0.2), Pose(0, 0.3, -0.4, 0.2, 25, 3, -2)])
def test_a_node_past_a_wall_keeps_the_face_it_slipped_from(
    raised: float | None, pose: Pose
) -> None:
    """Whatever is beyond the wall, nothing or another shape; a node under the face does not."""
    beyond = () if raised is None else (
        FlatPunch(shape="flat_punch", length_mm=9, width_mm=9, raised_mm=raised),
    )  # fmt: skip
    tool = Tool.of((PUNCH, *beyond), Path())
    inside, outside = np.array([[1.99, 0.3, 0.0]]), np.array([[2.03, 0.32, 0.0]])
    rest = Pose()
    start, end = (tool.carried(rest, pose, p) for p in (inside, outside))
    first = tool.surface(pose, start)
    held = tool.surface(pose, end, first)
    np.testing.assert_array_equal(held.met_mm, first.met_mm)
    np.testing.assert_array_equal(held.normal, first.normal)
    back = tool.surface(pose, start - [0.1, 0, 0], held)
    alone = tool.surface(pose, start - [0.1, 0, 0])
    np.testing.assert_array_equal(back.met_mm, alone.met_mm)
    # The other way, from the higher face under the lower one, nothing is held.
    entered = tool.surface(pose, start, tool.surface(pose, end))
    np.testing.assert_array_equal(entered.met_mm, first.met_mm)


def test_slopes_are_no_walls() -> None:
    """A node that moves far over a steep flank or a round one takes the tool where it comes to."""
    far = np.array([[2.4, 0.7, 0.0]])
    for shape in (CONE, Cone(shape="cone", included_angle_deg=20, tip_radius_mm=0.1)):
        tool = Tool.of([shape], Path())
        near = tool.surface(Pose(), np.array([[0.2, 0.1, 0.0]]))
        np.testing.assert_array_equal(
            tool.surface(Pose(), far, near).met_mm, tool.surface(Pose(), far).met_mm
        )


@pytest.mark.parametrize("side", [-5e-5, 5e-5])
def test_a_face_is_level_up_to_its_wall(side: float) -> None:
    tool = Tool.of(
        (PUNCH, FlatPunch(shape="flat_punch", length_mm=9, width_mm=9, raised_mm=2.0)), Path()
    )
    surface = tool.surface(Pose(), np.array([[2.01 + side, 0.0, 0.0]]))
    np.testing.assert_array_equal(surface.normal, [[0.0, 0.0, 1.0]])


@pytest.mark.parametrize("friction", [0.0, 0.5, 3.0])
@pytest.mark.parametrize("name", STEPPED)
def test_stepped_tools_converge(name: str, friction: float) -> None:
    """Pressed, slid and turned; no node is in the tool, pulled, or pushed from afar."""
    kept = SurfaceCompliance(small_pad(0.49))
    tool = Tool.of(STEPPED[name], Path())
    path = (
        Pose(), Pose(depth_mm=0.35), Pose(depth_mm=0.7), Pose(0, 1.3, -0.6, 0.7),
        Pose(0, 1.3, -0.6, 0.7, 25.0), Pose(0, 1.3, -0.6, 0.5, 25.0, 3.0), Pose(depth_mm=-1.0),
    )  # fmt: skip
    states = list(ContactSolver(kept, tool, ContactSettings(1e-3, friction)).states(path))
    for pose, state in zip(path[1:-1], states[1:-1], strict=True):
        places = kept.bundle.mesh.surface_mm + state.displacement_mm
        above = tool.clearance_mm(pose, places)
        assert above.min() > -2e-3 * pose.depth_mm
        # A node that slipped past a wall in the step is held by the face beside it.
        for node in np.flatnonzero((state.touch > 0) & (np.abs(above) > 2e-3 * pose.depth_mm)):
            around = places[node] + np.column_stack([AROUND, np.zeros(len(AROUND))])
            assert tool.clearance_mm(pose, around).min() < 0.03 * pose.depth_mm
        moved = kept.whole(state.force_n)
        np.testing.assert_allclose(moved, state.displacement_mm, atol=1e-4 * pose.depth_mm)
    assert not states[-1].force_n.any()


def test_large_strain_at_a_wall() -> None:
    """Newton's steps on the whole gel meet the same walls."""
    one = ContactSolver(
        SurfaceCompliance(small_pad(0.49)),
        Tool.of((CONE, RING), Path()),
        ContactSettings(1e-3, 0.5),
    )
    path = (Pose(), *(Pose(time_s=k, depth_mm=d) for k, d in enumerate((0.35, 0.7), 1)))
    states = list(NonlinearContact(one, tolerance=1e-2).states(path))
    assert all(np.isfinite(list(s.solver.values())).all() for s in states)
    assert states[2].force_n[:, 2].sum() < states[1].force_n[:, 2].sum() < 0


@pytest.mark.parametrize(
    "seed", quick([13, 32, 88, 101, 162, 170, 175, 666, 759], lambda seed: seed > 162)
)
def test_random_scenes_that_did_not_converge(folder: Path, seed: int) -> None:
    """With and without friction: shapes side by side, rough planes, a rod sheared over its side."""
    finger, scene = random_contact(seed)
    scene["effects"]["nonlinearity"] = "off"
    one = Trial.of(finger, scene, folder)
    for without in ((), ("friction", "relaxation")):
        states = one.carried_out(one.full(*without)).states
        assert len(states) == len(one.poses)
        assert any(s.force_n.any() for s in states)
        for state in states:
            assert (state.solver or {}).get("residual", 0.0) <= 1e-3
            assert np.isfinite(state.force_n).all()
