"""Load steps, the places at which nodes will stick, the stored block and the solver's report."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from contact_pads import small_pad
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gelslim_twin.contact.gel_state import AnchoredState, GelState, anchor_mm
from gelslim_twin.contact.solver import Candidates, ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import FlatPunch, Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance

Array = NDArray[np.float64]
RADIUS_MM, CELL_MM = 5.0, 1.2
BALL = Sphere(shape="sphere", radius_mm=RADIUS_MM)


def solver(friction: float, **settings: float) -> ContactSolver:
    pad = small_pad(0.45, 8, 2, 9.6)
    return ContactSolver(
        SurfaceCompliance(pad),
        Tool.of([BALL], Path()),
        ContactSettings(friction=friction, **settings),  # type: ignore[arg-type]
    )


def state(one: ContactSolver, touched: list[int]) -> GelState:
    """A displaced surface with some nodes in contact."""
    rng = np.random.default_rng(2)
    touch = np.zeros(len(one.points_mm), dtype=np.int8)
    touch[touched] = 1
    moved = 0.05 * rng.standard_normal(one.points_mm.shape)
    return GelState(moved, np.zeros_like(moved), touch)


def carried(before: Pose, after: Pose, places: Array) -> Array:
    """Rigid motion with the tool: twist about z first, then tilt about x, then about y."""
    turns = [
        Rotation.from_euler("zxy", [p.twist_deg, p.tilt_x_deg, p.tilt_y_deg], degrees=True)
        for p in (before, after)
    ]
    start, end = (np.array([p.x_mm, p.y_mm, -p.depth_mm]) for p in (before, after))
    return np.asarray(turns[1].apply(turns[0].inv().apply(places - start)) + end)


BEFORE = Pose(x_mm=0.3, y_mm=-0.1, depth_mm=0.3, twist_deg=4, tilt_x_deg=1)


@pytest.mark.parametrize(
    "after",
    [replace(BEFORE, x_mm=2.9, y_mm=0.9), replace(BEFORE, twist_deg=70, tilt_y_deg=-3),
     replace(BEFORE, depth_mm=0.9)],
)  # fmt: skip
@pytest.mark.parametrize("longest", [1.0, 0.4])
def test_no_node_is_dragged_farther_than_the_longest_step(after: Pose, longest: float) -> None:
    one, touched = solver(0.5, longest_step=longest), [10, 40, 62]
    last = state(one, touched)
    places = (one.points_mm + last.displacement_mm)[touched]
    far = np.hypot(*(carried(BEFORE, after, places) - places)[:, :2].T).max()
    count = max(1, math.ceil(far / (longest * CELL_MM)))
    poses = list(one.steps_to(last, BEFORE, after))
    assert len(poses) == count
    assert poses[-1] is after
    for number, pose in enumerate(poses, 1):
        for name in ("x_mm", "depth_mm", "twist_deg", "tilt_y_deg"):
            start, end = getattr(BEFORE, name), getattr(after, name)
            assert getattr(pose, name) == pytest.approx(start + number / count * (end - start))


def test_one_step_where_the_path_does_not_matter() -> None:
    """Without friction, without contact, or without a pose before; at most 200 otherwise."""
    far = replace(BEFORE, x_mm=3000.3)
    assert len(list(solver(0.0).steps_to(state(solver(0.0), [3]), BEFORE, far))) == 1
    one = solver(0.5)
    assert len(list(one.steps_to(state(one, []), BEFORE, far))) == 1
    assert list(one.steps_to(state(one, [3]), None, far)) == [far]
    assert len(list(one.steps_to(state(one, [3]), BEFORE, far))) == 200
    # An exact number of longest steps is not one more for rounding.
    assert len(list(one.steps_to(state(one, [3]), BEFORE, replace(BEFORE, x_mm=3.9)))) == 3


def test_nodes_stick_from_the_moment_of_their_contact() -> None:
    """The tool moves evenly: a node is met when its height, linear in time, is zero."""
    one, touched = solver(0.5), [30, 40]
    last = state(one, touched)
    before = Pose(x_mm=-2.6, depth_mm=0.25)
    after = Pose(x_mm=-1.8, y_mm=0.3, depth_mm=0.55)
    found = one.targets(last, before, after)
    target, ahead = found.target_mm, found.ahead_mm
    drag, kinds = np.array([0.8, 0.3, -0.3]), set()
    for k, (place, u) in enumerate(
        zip(one.points_mm + last.displacement_mm, last.displacement_mm, strict=True)
    ):
        heights = []
        for pose in (before, after):
            out = math.hypot(place[0] - pose.x_mm, place[1] - pose.y_mm)
            rise = RADIUS_MM - math.sqrt(max(RADIUS_MM**2 - out**2, 0.0))
            heights.append(rise - pose.depth_mm - place[2] if out <= RADIUS_MM else math.inf)
        first, then = heights
        if k in touched:
            share, kind = 1.0, "touched"
        elif math.isinf(first):
            share, kind = 0.5, "outside before"
        elif math.isinf(then) or then >= 0:
            share, kind = 0.0, "not met"
        else:
            share, kind = then / (then - max(first, 0.0)), f"met {first > 0}"
        kinds.add(kind)
        np.testing.assert_allclose(target[k], u + share * drag, atol=1e-12)
        np.testing.assert_allclose(ahead[k], u + (drag if k in touched else 0.0), atol=1e-12)
    assert kinds == {"touched", "outside before", "not met", "met True", "met False"}


def test_targets_start_from_the_anchors_and_turn_with_the_tool() -> None:
    one = solver(0.5)
    plain = state(one, list(range(81)))
    anchors = plain.displacement_mm + 0.01
    held = AnchoredState(plain.displacement_mm, plain.force_n, plain.touch, {}, anchors)
    after = replace(BEFORE, twist_deg=25, tilt_y_deg=4, y_mm=0.4)
    target = one.targets(held, BEFORE, after).target_mm
    expected = carried(BEFORE, after, one.points_mm + anchors) - one.points_mm
    np.testing.assert_allclose(target, expected, atol=1e-12)
    np.testing.assert_array_equal(one.targets(held, None, after).target_mm, anchors)
    assert anchor_mm(plain) is plain.displacement_mm
    smooth = solver(0.0)
    found = smooth.targets(state(smooth, [5]), BEFORE, after)
    target, ahead = found.target_mm, found.ahead_mm
    moved = state(smooth, [5]).displacement_mm
    dragged = carried(BEFORE, after, smooth.points_mm + moved) - smooth.points_mm
    np.testing.assert_allclose(target, dragged, atol=1e-12)
    np.testing.assert_allclose(ahead[5], dragged[5], atol=1e-12)
    np.testing.assert_array_equal(np.delete(ahead, 5, axis=0), np.delete(moved, 5, axis=0))


def test_candidates_grow_and_are_gathered_again_when_few_are_wanted() -> None:
    kept = SurfaceCompliance(small_pad(0.45, 8, 2, 8.0))

    def wanted(*nodes: int) -> NDArray[np.bool_]:
        return np.isin(np.arange(kept.nodes), nodes)

    first = Candidates(np.array([7, 3, 11, 20]), kept.block(np.array([7, 3, 11, 20])))
    assert first.including(wanted(3, 7, 20), kept) is first
    more = first.including(wanted(3, 7, 11, 40, 2), kept)
    assert more.nodes.tolist() == [7, 3, 11, 20, 2, 40]
    np.testing.assert_array_equal(more.block, kept.block(more.nodes))
    swapped = more.including(wanted(2, 3, 50, 51, 52), kept)
    assert swapped.nodes.tolist() == [2, 3, 50, 51, 52]
    # Six stored nodes for four are just allowed, for three they are too many.
    assert more.including(wanted(3, 7, 11, 40), kept) is more
    few = more.including(wanted(3, 7, 40), kept)
    assert few.nodes.tolist() == [3, 7, 40]
    np.testing.assert_array_equal(few.block, kept.block(few.nodes))


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_the_report_is_that_of_the_state(friction: float) -> None:
    """Penetration, and the largest force across a gap over the largest force and the depth."""
    one, pose = solver(friction, tolerance=1e-3), Pose(x_mm=0.2, depth_mm=0.5)
    found = list(one.states((Pose(), pose)))[1]
    places = one.points_mm + found.displacement_mm
    centre = np.array([0.2, 0.0, RADIUS_MM - 0.5])
    gap = np.linalg.norm(places - centre, axis=1) - RADIUS_MM
    on, push = found.touch > 0, np.linalg.norm(found.force_n, axis=1)
    assert on.any()
    assert found.solver["penetration_mm"] == pytest.approx(
        max(0.0, -gap[on].min()), rel=0.05, abs=1e-8
    )
    across = np.abs(push * gap)[on].max() / push.max()
    assert found.solver["complementarity"] * 0.5 == pytest.approx(across, rel=0.1, abs=1e-9)
    assert found.solver["iterations"] >= 1
    assert 0 <= found.solver["residual"] <= 1e-3


def test_a_tool_that_stays_is_not_solved_again() -> None:
    one, pose = solver(0.5), Pose(depth_mm=0.3)
    states = list(one.states((pose, replace(pose, time_s=1.0), replace(pose, twist_deg=1.0))))
    assert states[0] is states[1]
    assert states[1] is not states[2]


def test_a_surface_displaced_without_contact_stays_so() -> None:
    one = solver(0.3)
    offset = 0.01 * np.random.default_rng(0).standard_normal(one.points_mm.shape)
    rest = GelState.at_rest(len(offset))
    found = one.step(rest, None, Pose(depth_mm=-0.2), offset)
    np.testing.assert_array_equal(found.displacement_mm, offset)
    assert not found.force_n.any()
    pressed = one.step(rest, None, Pose(depth_mm=0.4), offset)
    moved = one.compliance.whole(pressed.force_n) + offset
    np.testing.assert_allclose(pressed.displacement_mm, moved, atol=2e-6)
    gap = (
        np.linalg.norm(one.points_mm + pressed.displacement_mm - [0, 0, RADIUS_MM - 0.4], axis=1)
        - RADIUS_MM
    )
    assert np.abs(gap[pressed.touch > 0]).max() < 2e-4 * 0.4
    assert gap.min() > -2e-4 * 0.4


def test_forces_of_a_level_punch_start_where_they_were() -> None:
    """A stuck punch moved by less than a cell: every node under it moves as the punch."""
    one = ContactSolver(
        SurfaceCompliance(small_pad(0.45, 8, 2, 8.0)),
        Tool.of([FlatPunch(shape="flat_punch", length_mm=4, width_mm=2)], Path()),
        ContactSettings(1e-6, 50.0),
    )
    press, side = Pose(depth_mm=0.2), Pose(x_mm=0.02, y_mm=-0.01, depth_mm=0.2)
    first, second = list(one.states((Pose(), press, side)))[1:]
    under = (np.abs(one.points_mm[:, :2]) <= [2.0, 1.0]).all(axis=1)
    assert ((first.touch > 0) == under).all()
    stuck = under & (second.touch > 0)
    assert stuck.sum() > 0.5 * under.sum()
    moved = (second.displacement_mm - first.displacement_mm)[stuck]
    np.testing.assert_allclose(moved, np.tile([0.02, -0.01, 0.0], (stuck.sum(), 1)), atol=1e-6)
    sticks = second.touch == 1
    assert sticks.sum() > 0.5 * under.sum()
    anchors, last = anchor_mm(second), anchor_mm(first)
    drag = np.tile([0.02, -0.01, 0.0], (sticks.sum(), 1))
    np.testing.assert_allclose((anchors - last)[sticks], drag, atol=1e-15)
    np.testing.assert_array_equal(anchors[~sticks], second.displacement_mm[~sticks])


def test_nodes_that_a_level_punch_comes_over_stick_for_half_the_step() -> None:
    """Outside its outline there is no height from which the moment of the contact would follow."""
    one = ContactSolver(
        SurfaceCompliance(small_pad(0.45, 8, 2, 8.0)),
        Tool.of([FlatPunch(shape="flat_punch", length_mm=4, width_mm=2)], Path()),
        ContactSettings(1e-3, 0.5),
    )
    before, after = Pose(x_mm=-0.5, depth_mm=0.2), Pose(x_mm=0.5, depth_mm=0.2)
    target = one.targets(GelState.at_rest(len(one.points_mm)), before, after).target_mm
    x, inside = one.points_mm[:, 0], np.abs(one.points_mm[:, 1]) <= 1.0
    expected = np.where(inside & (x >= -2) & (x < 2), 1.0, 0.0)
    expected[~(inside & (np.abs(x + 0.5) <= 2))] = 0.5
    expected[inside & (x == -2)] = 0.0
    np.testing.assert_allclose(target[:, 0], expected, atol=1e-12)
    assert not target[:, 1:].any()


def test_only_nodes_near_the_contact_are_candidates(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those whose gap at rest is a fifth of the depth or less, but for a few that bulge."""
    counts: list[int] = []
    block = SurfaceCompliance.block

    def watched(self: SurfaceCompliance, nodes: NDArray[np.intp], *known: object) -> object:
        counts.append(len(nodes))
        return block(self, nodes, *known)  # type: ignore[arg-type]

    monkeypatch.setattr(SurfaceCompliance, "block", watched)
    one = solver(0.3)
    list(one.states((Pose(), Pose(depth_mm=0.4))))
    out = np.hypot(*one.points_mm[:, :2].T)
    near = (out**2 / (2 * RADIUS_MM) < 1.2 * 0.4).sum()
    assert near <= max(counts) <= 1.3 * near < 0.5 * len(out)
    assert len(counts) <= 3
