"""Batches: every contact is a step from the untouched gel, and failed ones lose no others."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from batch_rig import contacts
from stepping_rig import DT_S, LINEAR, at, ball_facets, box_facets, linear_twin, turned, write_stl

from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.step_error import StepError
from gelslim_twin.stepping.twin import Twin


@pytest.mark.parametrize("friction", [0.0, 0.6])
def test_every_contact_is_a_step_from_the_untouched_gel(pad: Path, friction: float) -> None:
    """To the last bit, whatever was solved before, and the state of the twin stays."""
    twin = linear_twin(pad, friction=friction)
    twin.add(Body.box(3.0, 2.0, 3.0))
    twin.step(at(1.0, 0.0, 1.4), DT_S)
    before = twin.state
    poses = contacts(6, 1.5, tilt_deg=3.0)
    batch = twin.batch(poses)
    assert twin.state is before
    assert batch.solved.all()
    for number, pose in enumerate(poses):
        twin.reset()
        step = twin.step(pose, DT_S)
        np.testing.assert_array_equal(batch.force_n[number], step.force_n)
        np.testing.assert_array_equal(batch.displacement_mm[number], step.displacement_mm)
        np.testing.assert_allclose(batch.wrench[number], step.wrench, rtol=1e-12, atol=1e-15)
        assert batch.excess[number] == step.excess
        assert batch.in_contact[number] == step.in_contact


def test_several_bodies_and_quaternions(pad: Path) -> None:
    twin = linear_twin(pad)
    twin.add(Body.sphere(4.0))
    twin.add(Body.box(2.0, 2.0, 2.0))
    rows = np.zeros((2, 2, 7))
    rows[..., 3] = 1.0
    rows[:, 0, :3] = [[-2.0, 0.0, 3.8], [-2.0, 0.5, 9.0]]
    rows[:, 1, :3] = [[3.0, 0.0, 0.9], [3.0, 0.0, 0.8]]
    batch = twin.batch(rows)
    for number, row in enumerate(rows):
        twin.reset()
        np.testing.assert_array_equal(batch.force_n[number], twin.step(row, DT_S).force_n)


def test_failed_poses_lose_no_others(pad: Path, tmp_path: Path) -> None:
    """Too deep, not finite, not rigid, an undercut: each has its error by its number."""
    twin, alone = linear_twin(pad), linear_twin(pad)
    lid = np.concatenate([box_facets(4, 4, 0.4), box_facets(6, 4, 1) + np.array([0, 0, 0.9])])
    shelf = Body.from_mesh(write_stl(tmp_path / "shelf.stl", lid))
    good = [at(0.2, 0.1, 3.8), at(0.0, 0.0, 5.0), at(-1.0, 0.0, 3.9)]
    stretched = at(0.0, 0.0, 3.9)
    stretched[0, 0] = 1.1
    poses = [good[0], at(0, 0, 2.0), good[1], np.full((4, 4), np.nan), stretched, good[2]]
    twin.add(Body.sphere(4.0))
    alone.add(Body.sphere(4.0))
    batch, known = twin.batch(poses), alone.batch(good)
    assert list(batch.errors) == [1, 3, 4]
    assert all(isinstance(error, StepError) for error in batch.errors.values())
    np.testing.assert_array_equal(batch.solved, [True, False, True, False, False, True])
    np.testing.assert_array_equal(batch.force_n[batch.solved], known.force_n)
    assert np.isnan(batch.wrench[~batch.solved]).all()
    np.testing.assert_array_equal(batch.in_contact, [True, False, False, False, False, True])
    with pytest.raises(StepError, match="3 of 6 poses failed: pose 1: body sphere goes"):
        batch.require_solved()
    assert known.require_solved() is known
    hidden = linear_twin(pad)
    hidden.add(shelf)
    found = hidden.batch([at(0, 0, 0.1), at(0, 0, -0.7)])
    assert list(found.errors) == [1]
    assert found.in_contact[0]


@pytest.mark.parametrize(
    "poses",
    [np.eye(4), np.zeros((3, 6)), np.zeros((2, 2, 4, 4)), "down", [[1.0], [2.0, 3.0]]],
)
def test_arrays_that_are_no_poses_are_refused(pad: Path, poses: Any) -> None:
    twin = linear_twin(pad)
    with pytest.raises(StepError, match="no body"):
        twin.batch([at(0, 0, 3.9)])
    twin.add(Body.sphere(4.0))
    with pytest.raises(StepError, match="poses"):
        twin.batch(poses)


def test_settings_without_a_batch_are_refused(pad: Path) -> None:
    terms = {"relaxation": {"terms": [{"fraction": 0.2, "time_s": 1.0}]}}
    relaxing = Twin(pad, effects={**LINEAR, **terms})
    relaxing.add(Body.sphere(4.0))
    with pytest.raises(StepError, match="relaxes"):
        relaxing.batch([at(0, 0, 3.9)])
    twin = linear_twin(pad)
    twin.add(Body.sphere(4.0))
    with pytest.raises(StepError, match="backend"):
        twin.batch([at(0, 0, 3.9)], backend="jax")  # type: ignore[arg-type]
    none = twin.batch(np.zeros((0, 4, 4)))
    assert len(none) == 0
    assert none.wrench.shape == (0, 6)


def test_markers_and_pictures_are_those_of_steps(seen_pad: Path) -> None:
    still = {**LINEAR, "motion_blur": "off"}
    twin = Twin(seen_pad, ("force", "image"), {"image": 0.5}, effects=still, seed=3)
    twin.add(Body.sphere(6.0))
    poses = np.array([at(0, 0, 5.6), at(0, 0, 2.0), at(1, 0, 5.8)])
    batch = twin.batch(poses)
    assert np.isnan(batch.markers_px[1]).all()
    step = twin.step(poses[0], DT_S)
    np.testing.assert_array_equal(batch.markers_px[0], step.markers_px)
    # The first contact has the noise of a twin's first step.
    np.testing.assert_array_equal(batch.images([0])[0], step.image())
    two = batch.images(batch.solved)
    assert two.shape == (2, 480, 640, 3)
    assert (two[0] != two[1]).any()
    for wrong in (None, [1], [3], [-1], [0.5]):
        with pytest.raises(StepError, match="images"):
            batch.images(wrong)
    assert batch.images([]).shape == (0, 480, 640, 3)


def test_what_is_not_observed_is_refused(pad: Path) -> None:
    twin = linear_twin(pad)
    twin.add(Body.sphere(4.0))
    batch = twin.batch([at(0, 0, 3.9)])
    with pytest.raises(StepError, match="not observed"):
        batch.images()
    with pytest.raises(StepError, match="not observed"):
        _ = batch.markers_px


def test_a_soft_layer_and_a_turned_mesh(pad: Path, tmp_path: Path) -> None:
    ball = Body.from_mesh(write_stl(tmp_path / "ball.stl", ball_facets(4.0, 12)))
    for body, turn in (
        (Body.sphere(4.0).with_layer(1.0, 0.2), None),
        (ball, turned("x", 40.0)),
    ):
        twin = linear_twin(pad)
        twin.add(body)
        poses = [at(0.3, 0.1, 3.8, turn), at(-0.4, 0.2, 3.7, turn)]
        batch = twin.batch(poses)
        twin.step(poses[0], DT_S)
        twin.reset()
        step = twin.step(poses[1], DT_S)
        np.testing.assert_array_equal(batch.displacement_mm[1], step.displacement_mm)
