"""Several bodies: each pushes by its own nodes, they feel each other's field, the sum is whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from stepping_rig import DT_S, LINEAR, Array, at, linear_twin, turned

from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.step import Step
from gelslim_twin.stepping.twin import Twin

AWAY = at(0.0, 0.0, 30.0)


def pair(pad: Path, friction: float = 0.0) -> Twin:
    twin = linear_twin(pad, friction=friction)
    twin.add(Body.sphere(3.0, name="left"))
    twin.add(Body.sphere(2.5, name="right"))
    return twin


def poses(left: Array, right: Array) -> Array:
    return np.stack([left, right])


def assert_whole(step: Step, motions: Array) -> None:
    """The reactions have the resultant of the nodal forces, with its torque."""
    places = step.points_mm + step.displacement_mm
    force, torque = step.force_n.sum(axis=0), np.cross(places, step.force_n).sum(axis=0)
    size = max(1e-6, float(np.abs(step.reactions).max()))
    np.testing.assert_allclose(-step.reactions[:, :3].sum(axis=0), force, atol=1e-12 * size)
    moments = step.reactions[:, 3:] + np.cross(motions[:, :3, 3], step.reactions[:, :3])
    np.testing.assert_allclose(-moments.sum(axis=0), torque, atol=1e-11 * size)


def test_a_body_that_is_away_changes_nothing(pad: Path) -> None:
    one = linear_twin(pad, friction=0.5)
    one.add(Body.sphere(3.0))
    two = pair(pad, friction=0.5)
    for x in (0.0, 0.2, 0.4):
        known = one.step(at(x, 0.3, 2.8), DT_S)
        found = two.step(poses(at(x, 0.3, 2.8), AWAY), DT_S)
        np.testing.assert_array_equal(found.force_n, known.force_n)
        np.testing.assert_array_equal(found.reactions, [known.reactions[0], np.zeros(6)])


def test_two_bodies_beside_each_other(pad: Path) -> None:
    """Distant bodies push like single ones; overlapping ones share it."""
    single = linear_twin(pad)
    single.add(Body.sphere(3.0))
    twin = linear_twin(pad)
    twin.add(Body.sphere(3.0, name="left"))
    twin.add(Body.sphere(3.0, name="right"))
    for x, alike in ((4.0, 0.02), (0.8, None)):
        known = [single.step(at(side * x, 0, 2.8), DT_S).wrench[2] for side in (-1, 1)]
        motions = poses(at(-x, 0, 2.8), at(x, 0, 2.8))
        step = twin.step(motions, DT_S)
        assert_whole(step, motions)
        left, right = step.reactions[:, 2]
        if alike is not None:
            assert left == pytest.approx(right, rel=1e-4)
            assert left == pytest.approx(-known[0], rel=alike)
        else:
            # A row of nodes lies between the two and belongs to the first.
            assert min(left, right) > 0.3 * -known[0]
            assert 0.7 < (left + right) / -sum(known) < 0.95


def test_two_bodies_at_one_pose_are_one_tool(pad: Path) -> None:
    """Spheres that move together are the composite tool of a scene with two indenters."""
    balls = (
        Sphere(shape="sphere", radius_mm=3.0, x_mm=-1.2),
        Sphere(shape="sphere", radius_mm=2.5, x_mm=1.3, raised_mm=0.05),
    )
    known, found = linear_twin(pad, friction=0.4), pair(pad, friction=0.4)
    known.add(Body.from_indenters(*balls))
    for x, depth in ((0.0, 0.1), (0.2, 0.2), (0.5, 0.2)):
        tool = known.step(at(x, 0, -depth), DT_S)
        motions = poses(at(x - 1.2, 0, 3.0 - depth), at(x + 1.3, 0, 2.55 - depth))
        step = found.step(motions, DT_S)
        size = np.abs(tool.force_n).max()
        np.testing.assert_allclose(step.force_n, tool.force_n, atol=2e-3 * size)
        np.testing.assert_allclose(step.wrench, tool.wrench, atol=1e-3 * np.abs(tool.wrench).max())
        assert_whole(step, motions)


def test_bodies_pull_the_gel_their_own_way(pad: Path) -> None:
    """Two bodies that shear apart: friction pulls each back, and nearly nothing in the sum."""
    twin = linear_twin(pad, friction=0.8)
    for name in ("left", "right"):
        twin.add(Body.sphere(3.0, name=name))
    twin.step(poses(at(-2.5, 0, 2.8), at(2.5, 0, 2.8)), DT_S)
    for shear in (0.05, 0.1):
        motions = poses(at(-2.5 - shear, 0, 2.8), at(2.5 + shear, 0, 2.8))
        step = twin.step(motions, DT_S)
    (left, *_), (right, *_) = step.reactions
    assert left > 0.01
    assert left == pytest.approx(-right, rel=2e-3)
    assert abs(step.wrench[0]) < 2e-3 * left


def test_random_steps_of_two_bodies_conserve_the_total(pad: Path) -> None:
    rng = np.random.default_rng(21)
    twin, again = pair(pad, friction=0.6), pair(pad, friction=0.6)
    touched = 0
    places = np.array([[-1.5, 0.0, 2.9], [1.5, 0.5, 2.4]])
    for _ in range(30):
        places += rng.normal(0, [0.15, 0.15, 0.06], (2, 3))
        places[:, 2] = np.clip(places[:, 2], [2.7, 2.2], [3.1, 2.6])
        turns = Rotation.from_rotvec(rng.normal(0, 0.2, (2, 3)))
        motions = poses(at(*places[0], turns[0]), at(*places[1], turns[1]))
        step = twin.step(motions, DT_S)
        assert_whole(step, motions)
        np.testing.assert_array_equal(step.force_n, again.step(motions, DT_S).force_n)
        touched += bool((np.abs(step.reactions[:, 2]) > 0).all())
    assert touched > 8


@pytest.mark.slow
def test_two_bodies_at_large_strain(pad: Path) -> None:
    twin = Twin(pad, friction=0.4, effects={"nonlinearity": "on"})
    soft = Twin(pad, friction=0.4, effects=LINEAR)
    for one in (twin, soft):
        one.add(Body.sphere(3.0))
        one.add(Body.box(2.0, 2.0, 4.0))
    for depth in (0.05, 0.2, 0.4):
        motions = poses(at(-2.5, 0, 3.0 - depth), at(2.5, 0, 2.0 - 0.7 * depth, turned("z", 20)))
        step, linear = (one.step(motions, DT_S) for one in (twin, soft))
        assert_whole(step, motions)
        assert step.large_strain
    # Large strain is stiffer, by about a tenth to a third at a fifth of the thickness.
    assert 1.03 < step.wrench[2] / linear.wrench[2] < 1.4
