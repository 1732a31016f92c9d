"""Newton's method on the whole gel: laws of contact and balance at every pose, and few steps."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from contact_pads import small_pad
from numpy.typing import NDArray

from gelslim_twin.contact.gel_body import SPRINGS, GelBody
from gelslim_twin.contact.gel_state import ContactStatus
from gelslim_twin.contact.newton_contact import NewtonContact, SolidState
from gelslim_twin.contact.nonlinear import NonlinearContact
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance

Array = NDArray[np.float64]
BALL_MM, TOLERANCE = 5.0, 1e-4
BALL = Tool.of([Sphere(shape="sphere", radius_mm=BALL_MM)], Path())
PATH = tuple(
    Pose(time_s=k, x_mm=x, y_mm=x / 2, depth_mm=d)
    for k, (d, x) in enumerate(
        ((0.2, 0), (0.4, 0), (0.6, 0), (0.8, 0), (0.8, 0.2), (0.8, 0.4), (0.4, 0.4), (-0.1, 0.4)), 1
    )
)
"""Pressed to 40 % of the thickness, sheared, half lifted and released."""
GELS = [(0.32, 0.5), (0.49, 0.0), (0.49, 0.5), (0.4999, 0.5)]
MOST_STEPS = {0.32: 30, 0.49: 32, 0.4999: 38}
"""Newton's steps along the whole path by Poisson's ratio."""


def model(poisson: float, friction: float) -> NewtonContact:
    pad = small_pad(poisson, 8, 2, 8.0)
    settings = ContactSettings(1e-3, friction)
    return NewtonContact(
        ContactSolver(SurfaceCompliance(pad), BALL, settings), GelBody(pad), TOLERANCE
    )


@cache
def walked(poisson: float, friction: float) -> tuple[NewtonContact, list[SolidState], list[float]]:
    """The model, its states along the path, and the share of springs at each of them."""
    one, before = model(poisson, friction), Pose()
    states, shares = [one.released()], []
    for pose in PATH:
        states.append(one.step(states[-1], before, pose))
        shares.append(-1.0 if one._tangent is None else one._tangent.share)
        before = pose
    return one, states[1:], shares


def normals(one: NewtonContact, pose: Pose, state: SolidState) -> Array:
    """Unit vectors (c, 3) from the surface nodes to the middle of the ball."""
    centre = [pose.x_mm, pose.y_mm, BALL_MM - pose.depth_mm]
    towards = centre - (one.solver.points_mm + state.displacement_mm)
    return np.asarray(towards / np.linalg.norm(towards, axis=1)[:, None])


@pytest.mark.parametrize(("poisson", "friction"), GELS)
def test_forces_of_the_gel_balance_those_of_the_contact(poisson: float, friction: float) -> None:
    """On every free node of the whole gel, from its displacement alone."""
    one, states, _ = walked(poisson, friction)
    for state in states[:-1]:
        assert state.whole_mm is not None
        rest = one.body.pad.force(state.whole_mm)
        rest[one.body.surface] -= state.force_n
        rest[np.asarray(one.body.bundle.mesh.bonded)] = 0.0
        off = np.linalg.norm(rest) / np.linalg.norm(state.force_n)
        assert off <= TOLERANCE
        assert state.solver["residual"] == pytest.approx(off, rel=1e-6)
        np.testing.assert_array_equal(state.whole_mm[one.body.surface], state.displacement_mm)


@pytest.mark.parametrize(("poisson", "friction"), GELS)
def test_nodes_in_contact_lie_on_the_tool_and_obey_coulomb(poisson: float, friction: float) -> None:
    one, states, _ = walked(poisson, friction)
    for pose, state in zip(PATH[:-1], states[:-1], strict=True):
        on, slack = state.touch > 0, 0.1 * TOLERANCE * pose.depth_mm
        places = one.solver.points_mm + state.displacement_mm
        gap = BALL.clearance_mm(pose, places)
        assert on.sum() > 8
        assert np.abs(gap[on]).max() < 1.1 * slack
        assert gap.min() > -1.1 * slack
        assert not state.force_n[~on].any()
        inwards = normals(one, pose, state)
        push = -(state.force_n * inwards).sum(axis=1)
        side = np.linalg.norm(state.force_n + push[:, None] * inwards, axis=1)
        assert push.min() > -1e-9
        sticks, slips = (state.touch == kind for kind in (ContactStatus.STICK, ContactStatus.SLIP))
        most = push.max()
        np.testing.assert_allclose(side[slips], friction * push[slips], atol=1e-3 * most)
        assert (side[sticks] <= friction * push[sticks] + 1e-3 * most).all()
        assert friction > 0 or not sticks.any()
        # The report holds the largest gap and the largest product of force and gap.
        centre = [pose.x_mm, pose.y_mm, BALL_MM - pose.depth_mm]
        off = np.linalg.norm(places - centre, axis=1)[on] - BALL_MM
        size = np.linalg.norm(state.force_n, axis=1)[on]
        deepest = -BALL.clearance_mm(pose, one.solver.points_mm).min()
        across = np.abs(size * off).max() / (size.max() * deepest)
        assert state.solver["complementarity"] == pytest.approx(across, rel=0.02, abs=1e-9)
        into = max(0.0, -off.min())
        assert state.solver["penetration_mm"] == pytest.approx(into, rel=0.02, abs=1e-9)


def test_sticking_nodes_are_carried_by_the_tool() -> None:
    """A node that sticks before and after moves as the tool; the anchor remembers it."""
    _, states, _ = walked(0.49, 0.5)
    both = (states[3].touch == ContactStatus.STICK) & (states[4].touch == ContactStatus.STICK)
    assert both.sum() > 4
    moved = (states[4].displacement_mm - states[3].displacement_mm)[both]
    np.testing.assert_allclose(moved[:, :2], np.tile([0.2, 0.1], (both.sum(), 1)), atol=2e-4)
    assert states[4].anchor_mm is not None
    free = states[4].touch == ContactStatus.FREE
    np.testing.assert_array_equal(states[4].anchor_mm[free], states[4].displacement_mm[free])


@pytest.mark.parametrize(("poisson", "friction"), GELS)
def test_few_steps_and_nothing_left_after_release(poisson: float, friction: float) -> None:
    _, states, shares = walked(poisson, friction)
    steps = [state.solver["iterations"] for state in states[:-1]]
    assert sum(steps) <= MOST_STEPS[poisson]
    assert not states[-1].force_n.any()
    assert not states[-1].displacement_mm.any()
    assert not states[-1].touch.any()
    # Only the nearly incompressible gel needs springs to hold it while it is strained.
    assert (max(shares) > 0) == (poisson > 0.499)
    assert shares[-1] == -1.0


def test_an_extrapolated_start_saves_steps() -> None:
    """Even steps of a press, from the last two states and from the last one alone."""
    _, states, _ = walked(0.32, 0.5)
    saved = 0.0
    for k in (2, 3):
        alone = model(0.32, 0.5).step(states[k - 1], PATH[k - 1], PATH[k])
        saved += alone.solver["iterations"] - states[k].solver["iterations"]
        size = np.linalg.norm(alone.force_n)
        assert np.linalg.norm(states[k].force_n - alone.force_n) < 2e-3 * size
    assert saved >= 1


def test_springs_leave_the_solution_as_it_is() -> None:
    """From the same state with the stiffest springs and with none."""
    one, states, _ = walked(0.49, 0.5)
    found = []
    for share in (0.0, SPRINGS[-1]):
        other = model(0.49, 0.5)
        other.body.__dict__["_spring_n_mm"] = one.body._spring_n_mm
        solver = replace(other)
        whole, held = states[2].whole_mm, np.zeros((len(one.body.surface), 3, 3))
        held[states[2].touch > 0] = np.eye(3)
        assert whole is not None
        assert states[2].pressure_mpa is not None
        solver._tangent = other.body.tangent(whole, states[2].pressure_mpa, held, share)
        assert solver._tangent.share == share
        found.append(solver.step(states[2], PATH[2], replace(PATH[2], depth_mm=0.61)))
    size = np.linalg.norm(found[0].force_n)
    assert np.linalg.norm(found[0].force_n - found[1].force_n) < 2e-3 * size
    assert found[1].solver["iterations"] <= 8


@pytest.mark.parametrize("layers", [1, 2])
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_both_methods_find_the_same_contact(layers: int, friction: float) -> None:
    """Iterations on the surface, taken over by Newton's method with the inner nodes of the gel."""
    pad = small_pad(0.49, 8, layers, 8.0)
    solver = ContactSolver(SurfaceCompliance(pad), BALL, ContactSettings(1e-4, friction))
    both = NonlinearContact(solver, tolerance=1e-3)
    poses = tuple(Pose(time_s=k, depth_mm=0.3 * k) for k in range(5))
    states = list(both.states(poses))
    newton = NewtonContact(solver, GelBody(pad), 1e-4)
    alone = newton.released()
    for k in range(1, 5):
        alone = newton.step(alone, poses[k - 1], poses[k])
        size = np.linalg.norm(alone.force_n)
        assert np.linalg.norm(states[k].force_n - alone.force_n) < 0.01 * size
        far = np.abs(states[k].displacement_mm - alone.displacement_mm).max()
        assert far < 0.01 * poses[k].depth_mm
    held = both.law.force(states[1].displacement_mm)
    assert np.linalg.norm(held - states[1].force_n) < 0.01 * np.linalg.norm(held)
