"""Hard cases of contact in steps, each against what is known of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contact_pads import YOUNGS_MPA, dense_compliance, small_pad
from scipy.spatial.transform import Rotation
from stepping_rig import DT_S, Array, at, linear_twin, pad_folder

from gelslim_twin.contact.solver import ContactSolver
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.step import Step

TOY = {"poisson": 0.32, "cells": 8, "layers": 2, "size": 8.0, "thick": 2.0}


@pytest.fixture(scope="module")
def toy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pad small enough for a dense compliance."""
    return pad_folder(tmp_path_factory.mktemp("toy"), **TOY)


def normal_compliance() -> Array:
    return dense_compliance(small_pad(**TOY))[2::3, 2::3]  # type: ignore[arg-type]


def assert_balanced(step: Step) -> None:
    """Finite, pushing only, and the reaction is the resultant of the forces."""
    assert np.isfinite(step.force_n).all()
    assert np.isfinite(step.displacement_mm).all()
    size = max(1e-9, float(np.abs(step.force_n).max()))
    assert step.force_n[:, 2].max() < 1e-2 * size
    np.testing.assert_allclose(
        step.reactions[:, :3].sum(axis=0), -step.force_n.sum(axis=0), atol=1e-12
    )


def test_a_pin_at_one_node(toy: Path) -> None:
    twin = linear_twin(toy)
    twin.add(Body.box(0.2, 0.2, 3.0))
    node = int(np.argmin(np.abs(twin.points_mm[:, :2] - [1.0, -2.0]).sum(axis=1)))
    step = twin.step(at(1.0, -2.0, 1.4), DT_S)
    assert np.flatnonzero(step.gel.touch).tolist() == [node]
    known = -0.1 / normal_compliance()[node, node]
    assert step.wrench[2] == pytest.approx(known, rel=1e-5)
    assert step.stiffness[2, 2] == pytest.approx(-known / 0.1, rel=1e-5)


def test_an_exactly_flat_punch(toy: Path) -> None:
    twin = linear_twin(toy)
    twin.add(Body.box(4.0, 2.0, 3.0))
    step = twin.step(at(0.0, 0.0, 1.35), DT_S)
    under = (np.abs(twin.points_mm[:, :2]) <= [2.0, 1.0]).all(axis=1)
    assert under.sum() == 15
    force = np.linalg.solve(normal_compliance()[np.ix_(under, under)], np.full(15, -0.15))
    assert (force < 0).all()
    np.testing.assert_allclose(step.force_n[under, 2], force, rtol=1e-4)
    assert not step.force_n[~under].any()


def test_a_tool_larger_than_the_pad(toy: Path) -> None:
    """Between a column that bulges freely, E A d/h, and one that cannot, M A d/h."""
    twin = linear_twin(toy)
    twin.add(Body.box(40.0, 40.0, 3.0))
    step = twin.step(at(0.0, 0.0, 1.4), DT_S)
    assert_balanced(step)
    assert step.gel.touch.all()
    material = small_pad(**TOY).material  # type: ignore[arg-type]
    confined = material.lame_lambda_mpa + 2 * material.shear_modulus_mpa
    low, high = (modulus * 64.0 * 0.1 / 2.0 for modulus in (YOUNGS_MPA, confined))
    assert low < -step.wrench[2] < high
    np.testing.assert_allclose(step.wrench[[0, 1, 3, 4, 5]], 0.0, atol=1e-4 * high)


def test_the_edge_of_the_pad(toy: Path) -> None:
    twin = linear_twin(toy, friction=0.4)
    twin.add(Body.box(4.0, 4.0, 3.0))
    twin.step(at(4.0, 0.0, 1.45), DT_S)
    step = twin.step(at(4.0, 0.1, 1.4), DT_S)
    assert_balanced(step)
    assert twin.points_mm[step.gel.touch > 0, 0].min() == 2.0
    # The force acts within the part of the pad that is covered.
    assert 2.0 < -step.wrench[4] / step.wrench[2] < 4.0


@pytest.mark.parametrize("friction", [0.0, 0.7])
def test_sliding_off(toy: Path, friction: float) -> None:
    twin = linear_twin(toy, force="2%", friction=friction)
    twin.add(Body.sphere(2.0))
    forces = []
    for x in np.arange(0.0, 6.6, 0.2):
        step = twin.step(at(x, 0.3, 1.8), DT_S)
        assert_balanced(step)
        forces.append(-step.wrench[2])
    assert forces[0] > 0.01
    assert forces[-1] == 0.0
    assert not step.displacement_mm.any()


def test_release_after_slip(toy: Path) -> None:
    twin, fresh = (linear_twin(toy, friction=0.5) for _ in range(2))
    for one in (twin, fresh):
        one.add(Body.sphere(2.0))
    for x in np.arange(0.0, 1.6, 0.2):
        slipped = twin.step(at(x, 0.0, 1.8), DT_S)
    ratio = np.hypot(*slipped.wrench[:2]) / -slipped.wrench[2]
    assert ratio == pytest.approx(0.5, rel=0.1)
    for height in (1.9, 1.98, 2.02):
        released = twin.step(at(x, 0.0, height), DT_S)
    assert not released.wrench.any()
    again = twin.step(at(x, 0.0, 1.8), DT_S)
    fresh.step(at(x, 0.0, 2.02), DT_S)
    np.testing.assert_array_equal(again.force_n, fresh.step(at(x, 0.0, 1.8), DT_S).force_n)


def test_nearly_incompressible_with_friction_one(tmp_path: Path) -> None:
    pad = pad_folder(tmp_path, **{**TOY, "poisson": 0.4999})
    twin = linear_twin(pad, force="1%", friction=1.0)
    twin.add(Body.sphere(3.0))
    rng = np.random.default_rng(41)
    place = np.array([0.0, 0.0, 2.9])
    for _ in range(15):
        place = np.clip(place + rng.normal(0, [0.1, 0.1, 0.05]), [-2, -2, 2.6], [2, 2, 3.05])
        assert_balanced(twin.step(at(*place), DT_S))


def test_a_ball_thrown_in_at_one_metre_per_second_comes_back(pad: Path) -> None:
    """0.5 g at 1 m/s, frictionless: the elastic gel gives the energy back."""
    mass_kg, dt = 5e-4, 5e-5
    twin = linear_twin(pad, force="2%")
    twin.add(Body.sphere(4.0))
    height, speed, depths = 4.1, -1000.0, []
    for _ in range(400):
        height += dt * speed
        step = twin.step(at(0.1, 0.0, height), dt)
        # 1 N on 1 kg is 1000 mm/s².
        speed += dt * 1000.0 * step.reactions[0, 2] / mass_kg
        depths.append(4.0 - height)
        if speed > 0 and not step.in_contact:
            break
    assert 0.5 < max(depths) < 1.8
    assert speed == pytest.approx(1000.0, rel=0.01)


@pytest.mark.parametrize("shape", ["sphere", "box"])
def test_a_closed_path_without_friction_costs_no_work(pad: Path, shape: str) -> None:
    """The gel is elastic: trapezoids over a loop, refined once.

    A ball moves in all six coordinates. A box does not slide: its edges would meet the nodes, which
    are points, with their whole depth at once.
    """
    ball = shape == "sphere"
    body = Body.sphere(4.0) if ball else Body.box(3.2, 3.2, 4.0)
    top, aside = (3.8, 1.0) if ball else (1.85, 0.0)
    errors = []
    for count in (24, 48):
        twin = linear_twin(pad, force="0.1%")
        twin.add(body)
        phase = 2 * np.pi * np.arange(count + 1) / count
        place = np.stack(
            [aside * np.cos(phase), 0.7 * aside * np.sin(phase), top - 0.05 * np.sin(2 * phase)]
        )
        vectors = np.stack(
            [0.03 * np.sin(phase), 0.04 * np.cos(phase), 0.2 * aside * np.sin(phase)]
        )
        turns = Rotation.from_rotvec(vectors.T)
        steps = [twin.step(at(*p, turn), DT_S) for p, turn in zip(place.T, turns, strict=True)]
        loads = np.stack([step.reactions[0] for step in steps])
        moves = np.column_stack(
            [np.diff(place.T, axis=0), (turns[1:] * turns[:-1].inv()).as_rotvec()]
        )
        work = ((loads[1:] + loads[:-1]) / 2 * moves).sum(axis=1)
        errors.append(abs(work.sum()) / np.abs(work).sum())
    assert errors[1] < 5e-3
    assert errors[1] < max(0.6 * errors[0], 1e-3)


@pytest.mark.slow
def test_a_body_that_sticks_to_the_gel_keeps_its_energy(pad: Path) -> None:
    """0.1 kg at 500 Hz for 10 s, in free oscillation: explicit coupling neither drives nor damps.

    The integrator is the semi-implicit one of physics engines, which keeps the energy of an elastic
    body on average; the span of each coordinate over a second varies by a few per cent.
    """
    mass_kg, dt = 0.1, 0.002
    twin = linear_twin(pad, force="1%", friction=0.8)
    twin.add(Body.sphere(6.0))
    twin.step(at(0.0, 0.0, 6.01), dt)
    place, speed, path = np.array([0.0, 5.3]), np.array([1.0, 0.0]), []
    for _ in range(5000):
        load = twin.step(at(place[0], 0.0, place[1]), dt).reactions[0, [0, 2]]
        speed = speed + dt * 1000.0 * (load / mass_kg - [0.0, 9.81])
        place = place + dt * speed
        path.append(place)
    first, last = np.ptp(path[:500], axis=0), np.ptp(path[-500:], axis=0)
    assert (first > 0.01).all()
    np.testing.assert_allclose(last, first, rtol=0.06)


def test_what_a_rim_has_pressed_down_is_solved_once(
    pad: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nodes that a rim met with its whole depth must not count as carried over a long way."""
    rounds = 0
    solved_round = ContactSolver._state

    def counted(self: ContactSolver, *given: Any) -> Any:
        nonlocal rounds
        rounds += 1
        return solved_round(self, *given)

    monkeypatch.setattr(ContactSolver, "_state", counted)
    twin = linear_twin(pad, "1%", friction=0.6)
    twin.add(Body.box(4.0, 4.0, 4.0))
    for depth_mm in (0.1, 0.2, 0.3, 0.4):
        twin.step(at(0.0, 0.0, 2.0 - depth_mm), DT_S)
    rounds, steps = 0, 60
    for way_mm in np.linspace(0.02, 1.2, steps):
        step = twin.step(at(float(way_mm), 0.0, 1.6), DT_S)
        assert_balanced(step)
    assert rounds <= 1.2 * steps
