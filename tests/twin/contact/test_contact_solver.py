"""A tool followed along paths on small pads: laws, limits, equilibrium, history."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from contact_pads import dense_compliance, small_pad
from numpy.typing import NDArray
from tool_height import tool_height_mm

from gelslim_twin.contact.gel_state import ContactError, ContactStatus, GelState
from gelslim_twin.contact.solver import (
    ContactSettings,
    ContactSolver,
    even_steps,
    with_halved_steps,
)
from gelslim_twin.scene.indenter import Cone, FlatPunch, Indenter, Ring, Sphere, Wedge
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.bundle import Bundle
from ifem_export.compliance.columns import SurfaceCompliance

Array = NDArray[np.float64]
BALL = Sphere(shape="sphere", radius_mm=6)
PUNCH = FlatPunch(shape="flat_punch", radius_mm=3.1)


def solver(
    shape: Indenter | None = None,
    friction: float = 0.5,
    pad: Bundle | None = None,
    **settings: float,
) -> ContactSolver:
    return ContactSolver(
        SurfaceCompliance(pad or small_pad()),
        Tool.of([shape or BALL], Path()),
        ContactSettings(**{"tolerance": 1e-5, "friction": friction, **settings}),  # type: ignore[arg-type]
    )


def walk(one: ContactSolver, *poses: Pose) -> list[GelState]:
    return list(one.states(tuple(poses)))


def press(depth: float, steps: int = 4, **place: float) -> list[Pose]:
    return [Pose(depth_mm=depth * k / steps, **place) for k in range(steps + 1)]


def slide(start: Pose, x: float, steps: int) -> list[Pose]:
    return list(even_steps(start, replace(start, x_mm=start.x_mm + x), steps))


def total(state: GelState) -> Array:
    return np.asarray(state.force_n.sum(axis=0))


def test_motion_is_that_of_the_forces() -> None:
    states = walk(solver(), *press(0.4), Pose(x_mm=0.2, depth_mm=0.4))
    moved = dense_compliance(small_pad()) @ states[-1].force_n.reshape(-1)
    assert np.abs(states[-1].displacement_mm).max() > 0.3
    np.testing.assert_allclose(states[-1].displacement_mm.reshape(-1), moved, atol=2e-6)


def test_forces_balance_the_bond() -> None:
    """Solved once more from the forces alone: what the acrylic holds is their sum."""
    pad = small_pad()
    state = walk(solver(), *press(0.4), Pose(x_mm=0.3, depth_mm=0.4))[-1]
    stiffness, load = pad.stiffness_matrix, np.zeros((pad.mesh.n_nodes, 3))
    load[np.asarray(pad.mesh.surface)] = state.force_n
    free = (3 * np.asarray(pad.mesh.free)[:, None] + np.arange(3)).ravel()
    u = np.zeros(load.size)
    u[free] = np.linalg.solve(stiffness.toarray()[np.ix_(free, free)], load.reshape(-1)[free])
    held = (stiffness @ u).reshape(-1, 3)[np.asarray(pad.mesh.bonded)].sum(axis=0)
    np.testing.assert_allclose(held, -total(state), atol=1e-8)
    np.testing.assert_allclose(
        u.reshape(-1, 3)[np.asarray(pad.mesh.surface)], state.displacement_mm, atol=2e-6
    )


@pytest.mark.parametrize(
    "shape",
    [BALL, PUNCH, Ring(shape="ring", outer_radius_mm=4, inner_radius_mm=2.2),
     Wedge(shape="wedge", included_angle_deg=90, length_mm=30, tip_radius_mm=0.2),
     Cone(shape="cone", included_angle_deg=120, tip_radius_mm=0.2)],
)  # fmt: skip
@pytest.mark.parametrize("place", [(0.0, 0.0), (6.0, 0.0), (6.0, 6.0)])
def test_nodes_lie_on_the_tool(shape: Indenter, place: tuple[float, float]) -> None:
    """In the middle, on the edge and on the corner of the pad, seen with the tool's own heights."""
    one = solver(shape, 0.4)
    x, y = place
    pose = Pose(x_mm=x + 0.2, y_mm=y, depth_mm=0.4)
    state = walk(one, *press(0.4, x_mm=x, y_mm=y), pose)[-1]
    touched = state.touch > 0
    now = one.points_mm + state.displacement_mm
    height = tool_height_mm(one.tool, pose, now[:, 0], now[:, 1])
    # A node may end just beyond a rim that it slipped off in this step; the next one lets it go.
    held = touched & np.isfinite(height)
    assert held.sum() > 0.85 * touched.sum() > 0
    assert np.abs(now[held, 2] - height[held]).max() < 3e-3 * 0.4
    assert (now[~touched, 2] < height[~touched] + 2e-3 * 0.4).all()
    for name, most in (("residual", 1e-5), ("penetration_mm", 4e-4), ("complementarity", 1e-3)):
        assert 0 <= state.solver[name] <= most


def test_without_friction_forces_are_normal_to_the_tool() -> None:
    one = solver(Sphere(shape="sphere", radius_mm=4), 0.0)
    pose = Pose(x_mm=1.3, y_mm=-0.4, depth_mm=0.6)
    state = walk(one, pose)[-1]
    touched = np.flatnonzero(state.touch)
    centre = np.array([1.3, -0.4, 4 - 0.6])
    towards = centre - (one.points_mm + state.displacement_mm)[touched]
    force = state.force_n[touched]
    size = np.linalg.norm(force, axis=1) * np.linalg.norm(towards, axis=1)
    np.testing.assert_allclose((force * towards).sum(axis=1), -size, rtol=1e-5)


def test_release_leaves_nothing() -> None:
    for friction in (0.0, 0.5):
        poses = [*press(0.5), Pose(x_mm=0.4, depth_mm=0.5), Pose(x_mm=0.4, depth_mm=-0.2)]
        state = walk(solver(friction=friction), *poses)[-1]
        assert not state.force_n.any()
        assert not state.displacement_mm.any()
        assert not state.touch.any()


@pytest.mark.parametrize("angle_deg", [60.0, 100.0])
def test_a_tip_that_rises_still_holds_the_node_that_it_pushed_aside(angle_deg: float) -> None:
    """Without friction the path does not matter: the same as pressed to that depth at once.

    The flank of the tip moves the only node that it meets sideways, from under the tip.
    """
    pad = SurfaceCompliance(small_pad(0.49, 12, 3, 12.0))
    cone = Cone(shape="cone", included_angle_deg=angle_deg, tip_radius_mm=0, x_mm=0.05)
    tool = Tool.of([cone], Path())

    def force_n(*depths_mm: float) -> NDArray[np.float64]:
        poses = tuple(Pose(time_s=float(k), depth_mm=d) for k, d in enumerate(depths_mm))
        solver = ContactSolver(pad, tool, ContactSettings(1e-4))
        return list(solver.states(poses))[-1].force_n.sum(axis=0)

    at_once, raised = force_n(0.0, 0.2), force_n(0.0, 0.3, 0.6, 0.2)
    assert at_once[2] < -1e-3
    assert raised == pytest.approx(at_once, abs=1e-3 * abs(at_once[2]))


def test_a_turn_without_a_press_does_nothing() -> None:
    states = walk(solver(PUNCH), Pose(), Pose(twist_deg=30), Pose(depth_mm=-0.1, twist_deg=60))
    assert not any(s.force_n.any() or s.displacement_mm.any() for s in states)


def test_grazing_one_node() -> None:
    one = solver(Sphere(shape="sphere", radius_mm=1.0), 0.5)
    state = walk(one, Pose(x_mm=0.02), Pose(x_mm=0.02, depth_mm=1e-3))[-1]
    touched = np.flatnonzero(state.touch)
    assert len(touched) == 1
    assert not one.points_mm[touched[0], :2].any()
    assert total(state)[2] < 0


def test_a_tool_finer_than_the_mesh_between_nodes_touches_nothing() -> None:
    needle = Cone(shape="cone", included_angle_deg=20, tip_radius_mm=0)
    state = walk(solver(needle, 0.5), Pose(), Pose(x_mm=0.5, y_mm=0.5, depth_mm=0.4))[-1]
    assert not state.force_n.any()


def test_full_stick_is_a_glued_punch() -> None:
    """Against the stiffness of the nodes under the punch, inverted directly."""
    one = solver(PUNCH, 1e3, tolerance=1e-8)
    poses = [Pose(), Pose(depth_mm=0.1), Pose(x_mm=0.05, depth_mm=0.1)]
    state = walk(one, *poses)[-1]
    under = np.flatnonzero(np.hypot(*one.points_mm[:, :2].T) <= 3.1)
    dof = (3 * under[:, None] + np.arange(3)).ravel()
    wanted = np.tile([0.05, 0.0, -0.1], len(under))
    force = np.linalg.solve(dense_compliance(small_pad())[np.ix_(dof, dof)], wanted)
    # A glued node may be pulled; here all of them are pressed.
    assert (force.reshape(-1, 3)[:, 2] < 0).all()
    np.testing.assert_allclose(state.force_n[under].reshape(-1), force, atol=3e-5)
    assert (state.touch[under] == ContactStatus.STICK).all()


@pytest.mark.parametrize("friction", [0.2, 1.0])
def test_full_slip_and_reversed(friction: float) -> None:
    """Tangential resultant is friction times the normal one, against the motion."""
    one = solver(PUNCH, friction)
    start = Pose(depth_mm=0.15)
    there = slide(start, 1.5, 10)
    states = walk(one, *press(0.15), *there, *slide(there[-1], -3.0, 20))
    forth, back = total(states[4 + 10]), total(states[-1])
    # The punch drags the gel along: the force on the gel points the way it slides. What has just
    # come under the punch still sticks.
    assert 0.93 * friction <= forth[0] / -forth[2] <= friction * (1 + 1e-4)
    assert 0.93 * friction <= back[0] / back[2] <= friction * (1 + 1e-4)
    slides = states[-1].touch == ContactStatus.SLIP
    assert slides.sum() > 0.9 * (states[-1].touch > 0).sum()
    one_by_one = np.hypot(*states[-1].force_n[slides, :2].T) / -states[-1].force_n[slides, 2]
    np.testing.assert_allclose(one_by_one, friction, rtol=1e-3)


def test_back_and_forth_within_stick_is_elastic() -> None:
    one = solver(PUNCH, 3.0, tolerance=1e-8)
    poses = [*press(0.2), Pose(x_mm=0.02, depth_mm=0.2), Pose(depth_mm=0.2)]
    states = walk(one, *poses)
    np.testing.assert_allclose(states[-1].force_n, states[-3].force_n, atol=1e-5)


def test_sliding_remembers() -> None:
    """Back in the middle after sliding, friction still pulls: the path matters."""
    one = solver(BALL, 0.3)
    start = Pose(depth_mm=0.4)
    there = slide(start, 0.5, 5)
    states = walk(one, *press(0.4), *there, *slide(there[-1], -0.5, 5))
    assert total(states[-1])[0] < -0.1 * abs(total(states[-1])[2])
    assert abs(total(states[4])[0]) < 1e-3 * abs(total(states[4])[2])


def test_sliding_across_the_whole_pad() -> None:
    """On from beyond one edge to beyond the other, in steps of two cells."""
    one = solver(BALL, 0.5, tolerance=1e-3)
    start = Pose(x_mm=-10.0, depth_mm=0.4)
    states = walk(one, start, *slide(start, 20.0, 10))
    pushed = [-total(s)[2] for s in states]
    assert pushed[0] == 0.0
    assert pushed[-1] == 0.0
    assert max(pushed) == max(pushed[3:8])
    middle = total(states[5])
    # A ball ploughs: its front is pressed more, and leans against the motion.
    assert -0.5 * middle[2] < middle[0] < -0.65 * middle[2]


def test_half_the_steps_half_the_difference() -> None:
    """The path's steps are refined: answers come together."""
    forces = []
    for steps in (2, 4, 8, 16):
        start = Pose(depth_mm=0.4)
        states = walk(
            solver(BALL, 0.4, longest_step=10.0), *press(0.4, steps), *slide(start, 0.3, steps)
        )
        forces.append(total(states[-1]))
    size = np.linalg.norm(forces[-1])
    gaps = [np.linalg.norm(a - forces[-1]) / size for a in forces[:-1]]
    assert gaps[2] < 0.02
    assert gaps[0] > gaps[2]


def test_long_steps_are_cut() -> None:
    """One pose far away is what several near ones are."""
    start = Pose(depth_mm=0.4)
    far = walk(solver(), *press(0.4), *slide(start, 3.0, 1))[-1]
    near = walk(solver(), *press(0.4), *slide(start, 3.0, 3))[-1]
    np.testing.assert_allclose(total(far), total(near), rtol=1e-6, atol=1e-9)


def test_twisting_a_punch_gives_a_torque_only() -> None:
    one = solver(FlatPunch(shape="flat_punch", radius_mm=3.4), 0.5)
    turn = [Pose(depth_mm=0.2, twist_deg=2.0 * k) for k in range(1, 11)]
    states = walk(one, *press(0.2), *turn)
    x, y = one.points_mm[:, :2].T
    torques = [float((x * s.force_n[:, 1] - y * s.force_n[:, 0]).sum()) for s in states]
    assert np.abs(total(states[-1])[:2]).max() < 1e-3 * -total(states[-1])[2]
    assert torques[4] == pytest.approx(0.0, abs=1e-4)
    assert (np.diff(torques[4:]) > -1e-6).all()
    # Full slip: friction at every node across its own radius.
    push, arm = -states[-1].force_n[:, 2], np.hypot(*one.points_mm[:, :2].T)
    limit = 0.5 * float((push * arm).sum())
    assert 0.9 * limit < torques[-1] < limit


def test_tilting_moves_the_pressure() -> None:
    one = solver(PUNCH, 0.5)
    state = walk(one, *press(0.2), *(Pose(depth_mm=0.2, tilt_y_deg=0.5 * k) for k in range(1, 5)))[
        -1
    ]
    push = -state.force_n[:, 2]
    # NormalDamping right-handed about y takes the side at +x down.
    assert (push * one.points_mm[:, 0]).sum() / push.sum() > 0.2


def test_halves_where_one_step_fails() -> None:
    tried: list[float] = []

    def step(state: float, before: Pose, pose: Pose) -> float:
        tried.append(pose.x_mm - before.x_mm)
        if pose.x_mm - before.x_mm > 0.3:
            raise ContactError("too far", 0.5)
        return state + pose.x_mm - before.x_mm

    assert with_halved_steps(step, 0.0, Pose(), Pose(x_mm=1.0), 3) == pytest.approx(1.0)
    assert tried == [1.0, 0.5, 0.25, 0.25, 0.5, 0.25, 0.25]
    with pytest.raises(ContactError) as caught:
        with_halved_steps(step, 0.0, Pose(), Pose(x_mm=8.0), 3)
    assert caught.value.residual == 0.5
