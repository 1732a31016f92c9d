"""The state of a twin: reset, clone, and back to a state to the last bit."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from stepping_rig import DT_S, Array, at, linear_twin

from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.state import TwinState
from gelslim_twin.stepping.step import Step
from gelslim_twin.stepping.step_error import StepError
from gelslim_twin.stepping.twin import Twin

RELAXING = {
    "nonlinearity": "off",
    "relaxation": {"terms": [{"fraction": 0.3, "time_s": 0.01}, {"fraction": 0.1, "time_s": 1}]},
}
LARGE = {"nonlinearity": "on"}


def walk(seed: int, steps: int, deepest: float = 0.35) -> list[Array]:
    """A random walk of a ball of 4 mm, in and out of contact, on the pad and off its edge."""
    rng = np.random.default_rng(seed)
    place, angles = np.array([0.0, 0.0, 3.9]), np.zeros(3)
    found = []
    for _ in range(steps):
        place += rng.normal(0, [0.15, 0.15, 0.1])
        place[:2] = np.clip(place[:2], -7.0, 7.0)
        place[2] = np.clip(place[2], 4.0 - deepest, 4.2)
        angles += rng.normal(0, 2.0, 3)
        found.append(at(*place, Rotation.from_euler("xyz", angles, degrees=True)))
    return found


def carried_out(twin: Twin, poses: list[Array]) -> list[Step]:
    return [twin.step(pose, DT_S) for pose in poses]


def assert_same(one: Step, other: Step) -> None:
    np.testing.assert_array_equal(one.force_n, other.force_n)
    np.testing.assert_array_equal(one.displacement_mm, other.displacement_mm)
    np.testing.assert_array_equal(one.gel.touch, other.gel.touch)
    np.testing.assert_array_equal(one.reactions, other.reactions)
    assert one.time_s == other.time_s


def sliding(pad: Path) -> Twin:
    return linear_twin(pad, force="2%", friction=0.7)


def relaxing(pad: Path) -> Twin:
    return Twin(pad, friction=0.4, effects=RELAXING)


def at_large_strain(pad: Path) -> Twin:
    return Twin(pad, friction=0.4, effects=LARGE)


@pytest.mark.parametrize("make", [sliding, relaxing])
def test_a_state_is_restored_exactly(
    pad: Path, tmp_path: Path, make: Callable[[Path], Twin]
) -> None:
    twin = make(pad)
    twin.add(Body.sphere(4.0))
    poses = walk(11, 24)
    carried_out(twin, poses[:12])
    kept, other = twin.state, twin.clone()
    kept.save(tmp_path / "state.npz")
    known = carried_out(twin, poses[12:])
    assert sum(step.in_contact for step in known) > 4

    other.step(poses[3], DT_S)
    assert other.state is not kept
    assert twin.state.number == 24
    other.state = kept
    twin.reset()
    twin.state = kept
    fresh = make(pad)
    fresh.add(Body.sphere(4.0))
    fresh.state = TwinState.load(tmp_path / "state.npz")
    for again in (other, twin, fresh):
        for one, two in zip(carried_out(again, poses[12:]), known, strict=True):
            assert_same(one, two)


@pytest.mark.slow
def test_a_state_at_large_strain_is_restored_exactly(pad: Path, tmp_path: Path) -> None:
    twin = at_large_strain(pad)
    twin.add(Body.sphere(4.0))
    # Deep enough for Newton's method on the whole gel, whose state is that of all nodes.
    poses = [at(0.02 * k, 0.0, 4.0 - 0.15 * k) for k in range(1, 7)]
    carried_out(twin, poses[:4])
    twin.state.save(tmp_path / "state.npz")
    known = carried_out(twin, poses[4:])
    fresh = at_large_strain(pad)
    fresh.add(Body.sphere(4.0))
    fresh.state = TwinState.load(tmp_path / "state.npz")
    for one, two in zip(carried_out(fresh, poses[4:]), known, strict=True):
        assert one.large_strain
        assert_same(one, two)
        np.testing.assert_array_equal(one.stiffness, two.stiffness)


def random_sequence(pad: Path, steps: int) -> None:
    """A random sequence is finite, balanced, and the same when repeated."""
    twins = [sliding(pad), sliding(pad)]
    for twin in twins:
        twin.add(Body.sphere(4.0))
    touched = 0
    for pose in walk(steps, steps):
        one, two = (twin.step(pose, DT_S) for twin in twins)
        assert_same(one, two)
        assert np.isfinite(one.force_n).all()
        assert np.isfinite(one.displacement_mm).all()
        total = one.force_n.sum(axis=0)
        torque = np.cross(one.points_mm, one.force_n).sum(axis=0)
        np.testing.assert_allclose(one.wrench, [*total, *torque], atol=1e-12)
        # The gel is pushed, and a tangential force is at most friction times the normal one.
        normal = (pose[:3, 3] - one.points_mm - one.displacement_mm) / 4.0
        push = -(one.force_n * normal).sum(axis=1)
        side = np.linalg.norm(one.force_n + push[:, None] * normal, axis=1)
        size = max(float(push.max()), 1e-9)
        assert push.min() > -1e-2 * size
        assert (side - 0.7 * push).max() < 1e-2 * size
        assert one.in_contact == bool(total.any())
        touched += one.in_contact
    assert 0.3 * steps < touched < steps


def test_fifty_random_steps(pad: Path) -> None:
    random_sequence(pad, 50)


@pytest.mark.slow
def test_a_thousand_random_steps(pad: Path) -> None:
    random_sequence(pad, 1000)


def test_reset_and_release_leave_no_trace(pad: Path) -> None:
    twin, poses = sliding(pad), walk(5, 10)
    twin.add(Body.sphere(4.0))
    first = carried_out(twin, poses)
    twin.reset()
    assert twin.state.time_s == 0.0
    for one, two in zip(carried_out(twin, poses), first, strict=True):
        assert_same(one, two)
    # After the body has left, the gel remembers neither its slip nor its place.
    away = twin.step(at(1.0, 0.0, 4.5), DT_S)
    assert not away.displacement_mm.any()
    pressed = twin.step(at(1.0, 0.0, 3.8), DT_S)
    fresh = sliding(pad)
    fresh.add(Body.sphere(4.0))
    fresh.step(at(1.0, 0.0, 4.5), DT_S)
    np.testing.assert_array_equal(pressed.force_n, fresh.step(at(1.0, 0.0, 3.8), DT_S).force_n)


def test_held_forces_relax_as_the_series_says(pad: Path) -> None:
    twin = relaxing(pad)
    twin.add(Body.sphere(4.0))
    steps = [twin.step(at(0, 0, 3.8), 0.002) for _ in range(40)]
    forces = np.array([step.wrench[2] for step in steps])
    elastic = Twin(pad, friction=0.4, effects={"nonlinearity": "off"})
    elastic.add(Body.sphere(4.0))
    known = elastic.step(at(0, 0, 3.8), 0.002).wrench[2]
    # The first step is a ramp of 2 ms; then each term decays by its own time constant.
    time = 0.002 * np.arange(40)
    fade = 1.0
    for fraction, tau in ((0.3, 0.01), (0.1, 1.0)):
        ramp = -np.expm1(-0.002 / tau) / (0.002 / tau)
        fade = fade - fraction * (1 - ramp * np.exp(-time / tau))
    np.testing.assert_allclose(forces / known, fade, rtol=1e-9)


def test_states_of_another_twin_are_refused(pad: Path, seen_pad: Path, tmp_path: Path) -> None:
    twin, other = linear_twin(pad), linear_twin(seen_pad)
    for one in (twin, other):
        one.add(Body.sphere(4.0))
    for wrong in (other.state, linear_twin(pad).state):
        with pytest.raises(StepError, match="belongs to another"):
            twin.state = wrong
    with pytest.raises(StepError, match="no state"):
        twin.state = 3  # type: ignore[assignment]
    for number, content in enumerate((b"", b"text", b"PK\x03\x04 broken")):
        path = tmp_path / f"{number}.npz"
        path.write_bytes(content)
        with pytest.raises(StepError, match="no state"):
            TwinState.load(path)
    with pytest.raises(StepError, match="no such file"):
        TwinState.load(tmp_path / "none.npz")


def test_a_damaged_file_is_refused(pad: Path, tmp_path: Path) -> None:
    twin = linear_twin(pad)
    twin.add(Body.sphere(4.0))
    twin.step(at(0, 0, 3.8), DT_S)
    path = tmp_path / "state.npz"
    twin.state.save(path)
    whole = path.read_bytes()
    for share in itertools.accumulate([0.2] * 4):
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(StepError):
            TwinState.load(path)
