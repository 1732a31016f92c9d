"""dF/dpose: finite differences, the analytic layer, Hertz, and what it refuses."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from stepping_rig import DT_S, LINEAR, Array, at, linear_twin, pad_folder

from gelslim_force.layer.ball_on_layer import BallOnLayer
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.step import Step
from gelslim_twin.stepping.twin import Twin

MOVE_MM, TURN_RAD = 5e-5, 5e-5
EXACT = "0.01%"


def moved(motions: Array, column: int, way: float) -> Array:
    """The motions with one body translated, or rotated about its origin."""
    found = motions.copy()
    body, axis = divmod(column, 6)
    if axis < 3:
        found[body, axis, 3] += way * MOVE_MM
    else:
        turn = Rotation.from_rotvec(way * TURN_RAD * np.eye(3)[axis - 3]).as_matrix()
        found[body, :3, :3] = turn @ found[body, :3, :3]
    return found


def by_differences(twin: Twin, motions: Array) -> tuple[Step, Array, bool]:
    """The step, central differences of its wrench, and whether the contact set stayed the same."""
    state = twin.state
    middle = twin.step(motions, DT_S)
    found, same = np.empty((6, 6 * len(motions))), True
    for column in range(found.shape[1]):
        ends = []
        for way in (1.0, -1.0):
            twin.state = state
            ends.append(twin.step(moved(motions, column, way), DT_S))
            same &= np.array_equal(ends[-1].gel.touch, middle.gel.touch)
        size = 2 * (MOVE_MM if column % 6 < 3 else TURN_RAD)
        found[:, column] = (ends[0].wrench - ends[1].wrench) / size
    return middle, found, same


def assert_derivative(twin: Twin, motions: Array) -> bool:
    """Compare where the contact set stays the same; returns whether it does."""
    step, known, same = by_differences(twin, np.atleast_3d(motions).reshape(-1, 4, 4))
    if not same:
        return False
    found = step.stiffness
    assert found.shape == known.shape
    # Forces and torques, by translations and by rotations, have sizes of their own. Where symmetry
    # makes those by rotations zero, those by a translation of 0.3 mm count.
    for rows in (slice(0, 3), slice(3, 6)):
        by_moving = [k for k in range(known.shape[1]) if k % 6 < 3]
        least = 0.3 * float(np.abs(known[rows][:, by_moving]).max())
        for part in (0, 3):
            columns = [k for k in range(known.shape[1]) if part <= k % 6 < part + 3]
            block = known[rows][:, columns]
            size = max(float(np.abs(block).max()), least)
            np.testing.assert_allclose(found[rows][:, columns], block, atol=1e-3 * size)
    return True


def tilted(place: Array, angles: Array) -> Array:
    return at(*place, Rotation.from_euler("xyz", angles, degrees=True))


@pytest.mark.parametrize("friction", [0.0, 0.5, 5.0])
@pytest.mark.parametrize("shape", ["sphere", "box"])
def test_it_is_the_difference_quotient(pad: Path, shape: str, friction: float) -> None:
    """A press, then steps with new nodes, stick and slip, from random poses of a seed."""
    rng = np.random.default_rng(31)
    body = Body.sphere(4.0) if shape == "sphere" else Body.box(3, 2, 4)
    height = 3.75 if shape == "sphere" else 1.85
    kept = 0
    for _ in range(3):
        twin = linear_twin(pad, force=EXACT, friction=friction)
        twin.add(body)
        place, angles = np.array([*rng.uniform(-2, 2, 2), height]), rng.uniform(-4, 4, 3)
        twin.step(tilted(place, angles), DT_S)
        place, angles = place + np.array([0.11, 0.07, -0.03]), angles + rng.uniform(-0.5, 0.5, 3)
        kept += assert_derivative(twin, tilted(place, angles))
    assert kept >= 2


@pytest.mark.parametrize(("shape", "friction"), [("sphere", 0.0), ("sphere", 5.0), ("box", 0.5)])
def test_it_is_the_difference_quotient_in_the_geometry_at_rest(
    tmp_path: Path, shape: str, friction: float
) -> None:
    pad, rng = pad_folder(tmp_path, poisson=0.45, cells=12), np.random.default_rng(31)
    twin = linear_twin(pad, force=EXACT, friction=friction)
    twin.add(Body.sphere(4.0) if shape == "sphere" else Body.box(3, 2, 4))
    height, kept = 3.75 if shape == "sphere" else 1.85, 0
    for _ in range(4):
        place = np.array([0.1, 0.05, height]) + rng.normal(0, [0.05, 0.05, 0.02])
        kept += assert_derivative(twin, tilted(place, rng.normal(0, 3, 3)))
    assert kept >= 3


@pytest.mark.slow
def test_random_bodies_poses_and_frictions(pad: Path) -> None:
    rng = np.random.default_rng(32)
    kept = 0
    for _ in range(24):
        twin = linear_twin(pad, force=EXACT, friction=rng.choice([0.0, 0.3, 1.0]))
        size = rng.uniform(1.5, 5.0)
        twin.add(Body.sphere(size) if rng.random() < 0.5 else Body.box(size, 1.5, 4.0))
        upright = size if twin.bodies[0].name == "sphere" else 2.0
        place = np.array([*rng.uniform(-5, 5, 2), upright - 0.15])
        angles = rng.uniform(-5, 5, 3)
        for _ in range(3):
            place = place + rng.normal(0, [0.05, 0.05, 0.02])
            angles = angles + rng.normal(0, 0.5, 3)
            step = twin.step(tilted(place, angles), DT_S)
            assert step.in_contact
        kept += assert_derivative(twin, tilted(place + np.array([0.03, 0.02, -0.01]), angles))
    assert kept >= 16


@pytest.mark.parametrize("friction", [0.0, 0.6])
def test_it_has_six_columns_per_body(pad: Path, friction: float) -> None:
    twin = linear_twin(pad, force=EXACT, friction=friction)
    twin.add(Body.sphere(3.0))
    twin.add(Body.box(2.0, 2.0, 4.0))
    twin.add(Body.sphere(1.0, name="away"))
    start = np.stack(
        [
            tilted(np.array([-1.9, 0.2, 2.8]), np.array([2.0, 0.0, 5.0])),
            tilted(np.array([1.8, 0.1, 1.85]), np.array([1.0, -2.0, 0.0])),
            at(0.0, 0.0, 9.0),
        ]
    )
    twin.step(start, DT_S)
    end = start.copy()
    end[:2, :3, 3] += [[0.08, 0.03, -0.02], [-0.05, 0.06, -0.01]]
    assert assert_derivative(twin, end)
    assert not twin.step(end, DT_S).stiffness[:, 12:].any()


def test_without_contact_it_is_zero(pad: Path) -> None:
    twin = linear_twin(pad)
    twin.add(Body.sphere(3.0))
    np.testing.assert_array_equal(twin.step(at(0, 0, 3.5), DT_S).stiffness, np.zeros((6, 6)))


@pytest.mark.slow
@pytest.mark.parametrize(("depth", "friction"), [(0.15, 0.5), (0.8, 5.0), (1.4, 0.5)])
def test_it_is_the_difference_quotient_at_large_strain(
    pad: Path, depth: float, friction: float
) -> None:
    """Light: the fixed point over linear contacts. Deep: Newton's method on the whole gel."""
    large = {"nonlinearity": "on"}
    twin = Twin(pad, tolerance={"force": EXACT}, friction=friction, effects=large)
    twin.add(Body.sphere(4.0))
    for share in (0.4, 0.7, 0.95):
        twin.step(at(0.1, 0.2, 4.0 - share * depth), DT_S)
    end = at(0.12, 0.21, 4.0 - depth)
    state, ends = twin.state, []
    step = twin.step(end, DT_S)
    assert step.large_strain
    size = 0.002
    for way in (1.0, -1.0):
        twin.state = state
        ends.append(twin.step(at(0.12, 0.21, 4.0 - depth + way * size), DT_S))
        np.testing.assert_array_equal(ends[-1].gel.touch, step.gel.touch)
    known = (ends[0].wrench - ends[1].wrench) / (2 * size)
    np.testing.assert_allclose(step.stiffness[:, 2], known, atol=1e-3 * np.abs(known).max())
    linear = Twin(pad, friction=friction, effects=LINEAR)
    linear.add(Body.sphere(4.0))
    assert step.stiffness[2, 2] > 1.02 * linear.step(end, DT_S).stiffness[2, 2]


def test_a_relaxing_gel_has_that_of_the_elastic_one(pad: Path) -> None:
    found = []
    for terms in ([], [{"fraction": 0.4, "time_s": 0.01}]):
        twin = Twin(pad, effects={**LINEAR, "relaxation": {"terms": terms}})
        twin.add(Body.sphere(3.0))
        twin.step(at(0, 0, 2.8), DT_S)
        found.append(twin.step(at(0, 0, 2.8), DT_S).stiffness)
    np.testing.assert_array_equal(found[0], found[1])


def test_the_layer_of_the_reference_is_hertz_where_it_is_thick() -> None:
    """dF/dd = 2 E* a on a half-space: the reference of the next test in its limit."""
    pair = [BallOnLayer.at(a, 40.0, 400.0, 0.3) for a in (0.99, 1.01)]
    slope = (pair[1].force_n_per_mpa - pair[0].force_n_per_mpa) / (
        pair[1].depth_mm - pair[0].depth_mm
    )
    assert slope == pytest.approx(2 * 1.0 / (1 - 0.3**2), rel=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("thick", "layers"), [(2.0, 6), (5.0, 9)])
def test_the_normal_stiffness_is_that_of_a_bonded_layer(
    tmp_path: Path, thick: float, layers: int
) -> None:
    """Against the integral equation of a wide layer; on 5 mm it is near Hertz's 2 E* a."""
    poisson, youngs, ball = 0.3, 0.147, 6.0
    pad = pad_folder(tmp_path, poisson=poisson, cells=30, layers=layers, size=12.0, thick=thick)
    twin = linear_twin(pad)
    twin.add(Body.sphere(ball))
    ratios = []
    for a in np.linspace(1.2, 1.5, 9):
        near, far = (BallOnLayer.at(a + s, ball, thick, poisson) for s in (-0.01, 0.01))
        slope = (far.force_n_per_mpa - near.force_n_per_mpa) / (far.depth_mm - near.depth_mm)
        depth = (near.depth_mm + far.depth_mm) / 2
        found = twin.step(at(0.0, 0.0, ball - depth), DT_S).stiffness[2, 2]
        ratios.append(found / (slope * youngs))
        if thick == 5.0:
            hertz = 2 * youngs / (1 - poisson**2) * math.sqrt(ball * depth)
            assert 1.0 < found / hertz < 1.6
    # The set of nodes changes in jumps, about which the mean is right.
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.03)
    assert np.max(np.abs(np.array(ratios) - 1)) < 0.12
