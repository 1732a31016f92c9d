"""Contact on moving tangent planes: laws with a displacement of its own, and damped normals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from contact_pads import dense_compliance, small_pad
from numpy.typing import NDArray

from gelslim_twin.contact.contact_forces import SLIP, STICK
from gelslim_twin.contact.gel_state import ContactError
from gelslim_twin.contact.plane_iteration import (
    AveragedNormals,
    BisectedNormals,
    PlaneIteration,
    allowed_motion_mm,
    gap_tolerance_mm,
)
from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool

Array = NDArray[np.float64]
RADIUS_MM, POSE = 4.0, Pose(x_mm=0.3, y_mm=-0.2, depth_mm=0.5)
CENTRE = np.array([0.3, -0.2, RADIUS_MM - 0.5])
BALL = Tool.of([Sphere(shape="sphere", radius_mm=RADIUS_MM)], Path())


def problem(friction: float, tolerance: float) -> PlaneIteration:
    """A ball on nodes that are displaced before it presses them; the outer ones are left out."""
    pad = small_pad(0.45, 8, 2, 8.0)
    points = np.asarray(pad.mesh.surface_mm)
    x, y = points[:, 0], points[:, 1]
    offset = np.column_stack([0.02 * np.sin(y), 0.03 * np.cos(x), 0.04 * np.sin(x + y)])
    target = offset + np.array([0.05, -0.03, 0.0])
    return PlaneIteration(
        BALL, POSE, dense_compliance(pad).astype(np.float32), points, offset, target,
        np.hypot(x, y) < 3.5, friction, tolerance, 0.5,
    )  # fmt: skip


@pytest.mark.parametrize("friction", [0.0, 0.3, 0.8])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_nodes_meet_the_ball_with_their_own_displacement(friction: float, tolerance: float) -> None:
    one = problem(friction, tolerance)
    still = np.zeros_like(one.points_mm)
    start = BALL.surface(POSE, one.points_mm + one.offset_mm)
    found = one.solve(start, one.offset_mm.copy(), still)
    force, moved = found.balance.force_n, found.balance.motion_mm
    np.testing.assert_allclose(
        moved.reshape(-1), one.block @ force.reshape(-1), atol=1e-6 * np.abs(moved).max()
    )
    towards = CENTRE - (one.points_mm + one.offset_mm + moved)
    far = np.linalg.norm(towards, axis=1)
    gap, normal = far - RADIUS_MM, towards / far[:, None]
    on = found.balance.touch > 0
    assert on.sum() > 5
    assert 0 < found.sweeps <= (4 if friction == 0 else 30)
    assert found.balance.residual <= 0.5 * tolerance
    assert not on[~one.wanted].any()
    slack = 0.1 * tolerance * 0.5
    assert np.abs(gap[on]).max() < 1.1 * slack
    assert gap[one.wanted].min() > -1.1 * slack
    np.testing.assert_allclose(found.gap_mm[on], gap[on], atol=0.2 * slack)
    push = -(force * normal).sum(axis=1)
    side = force + push[:, None] * normal
    size, most = np.linalg.norm(side, axis=1), push.max()
    slips, sticks = found.balance.touch == SLIP, found.balance.touch == STICK
    np.testing.assert_allclose(
        size[slips], friction * push[slips], atol=(1e-3 + 5 * tolerance) * most
    )
    assert (size[sticks] < friction * push[sticks] + tolerance * most).all()
    # Slip relative to the tool is opposed by friction; sticking nodes are at their targets.
    slip = one.offset_mm + moved - one.target_mm
    slip -= (slip * normal).sum(axis=1)[:, None] * normal
    far_mm = np.linalg.norm(slip, axis=1)
    assert far_mm[sticks].max(initial=0.0) < 20 * tolerance * 0.5
    if friction == 0:
        return
    against = (slip * side).sum(axis=1)[slips]
    assert (against <= -0.99 * (far_mm * size)[slips] + 1e-6).all()


def test_a_finer_tolerance_takes_more_sweeps_but_not_many() -> None:
    sweeps = []
    for tolerance in (1e-2, 1e-3, 1e-5):
        one = problem(0.5, tolerance)
        start = BALL.surface(POSE, one.points_mm + one.offset_mm)
        sweeps.append(one.solve(start, one.offset_mm, np.zeros_like(one.points_mm)).sweeps)
    assert sweeps == sorted(sweeps)
    assert sweeps[0] < sweeps[2] <= 80


def test_gap_tolerance_is_of_the_depth_down_to_rounding() -> None:
    """A tenth of the tolerance, at most a hundredth of the depth, at least 1e-8 mm."""
    assert gap_tolerance_mm(1e-3, 0.4) == pytest.approx(4e-5)
    assert gap_tolerance_mm(0.5, 0.4) == pytest.approx(4e-3)
    assert gap_tolerance_mm(1e-9, 0.4) == 1e-8
    one = problem(0.0, 2e-3)
    assert one.gap_tolerance_mm == pytest.approx(1e-4)


def test_allowed_motion_leads_to_the_plane() -> None:
    """From the place without the displacement, along the normal."""
    points = np.array([[0.5, 0.1, -0.1], [-0.2, 0.4, -0.3]])
    moved = np.array([[0.02, 0.01, -0.05], [0.0, -0.03, 0.02]])
    planes = BALL.surface(POSE, points)
    room = allowed_motion_mm(planes, points, moved)
    ends = points - moved + room[:, None] * planes.normal
    np.testing.assert_allclose(planes.gap_mm(ends), 0.0, atol=1e-12)


def test_averaged_normals_are_the_mean_of_all_so_far() -> None:
    rule, values = AveragedNormals(), [3.0, 5.0, -2.0, 8.0]
    mean, way = values[0], np.zeros((2, 3))
    for k, value in enumerate(values[1:], 2):
        share = rule(way)
        assert share.shape == (2,)
        mean += share[0] * (value - mean)
        assert mean == pytest.approx(np.mean(values[:k]))


def test_bisected_normals_halve_where_they_turn_back_and_grow_below_that() -> None:
    """One node keeps its way, one turns back and goes on."""
    rule, ahead = BisectedNormals(), np.array([0.0, 1.0, 0.0])
    shares = []
    for sign in (1.0, 1.0, -1.0, -1.0, -1.0, 1.0, 1.0):
        shares.append(rule(np.stack([ahead, sign * ahead])).copy())
    steady, turned = np.array(shares).T
    np.testing.assert_allclose(steady, [0.625, 0.78125, 0.9765625, 1, 1, 1, 1])
    half = 0.78125 / 2
    # Growth stays below the share at the last reversal.
    np.testing.assert_allclose(turned, [0.625, 0.78125, half, half, half, half / 2, half / 2])


def test_forces_that_never_settle_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    from gelslim_twin.contact import plane_iteration

    monkeypatch.setattr(plane_iteration, "GEOMETRY_STEPS", 1)
    one = problem(0.3, 1e-5)
    start = BALL.surface(POSE, one.points_mm)
    with pytest.raises(ContactError, match="1 iterations"):
        one.solve(start, np.zeros_like(one.points_mm), np.zeros_like(one.points_mm))
