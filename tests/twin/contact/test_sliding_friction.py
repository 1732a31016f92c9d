"""Friction by the speed of slip: its law, steady sliding, and what a contact at rest forgets."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from contact_pads import small_pad
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from gelslim_twin.contact.gel_state import ContactError, GelState
from gelslim_twin.contact.sliding_friction import SlidingContact, SlidingLaw, mean_slip_mm_s
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance

Array = NDArray[np.float64]
BALL = Tool.of([Sphere(shape="sphere", radius_mm=8.0)], Path())
FALLS = SlidingLaw(0.8, 0.5, 2.0, 0.6)
RISES = SlidingLaw(0.5, 0.8, 2.0, 0.3)


@cache
def pad() -> SurfaceCompliance:
    return SurfaceCompliance(small_pad(0.45, 14, 2, 14.0, 2.0))


def settings(law: SlidingLaw) -> ContactSettings:
    return ContactSettings(1e-4, law.static, geometry="rest")


def dragged(speed_mm_s: float, way_mm: float, poses: int = 10) -> tuple[Pose, ...]:
    """A press in a second, then a drag at one speed."""
    later = np.linspace(0, way_mm, poses + 1)
    return (Pose(), *(Pose(1 + x / speed_mm_s, float(x), 0.0, 0.3) for x in later))


def solved(law: SlidingLaw, poses: tuple[Pose, ...], share: float = 0.25) -> list[GelState]:
    return list(SlidingContact(pad(), BALL, settings(law), law, share).states(poses))


def ratio(state: GelState) -> float:
    """Tangential force over normal force."""
    force = state.force_n.sum(axis=0)
    return float(np.hypot(*force[:2]) / -force[2])


def test_the_mean_speed_solves_its_equation():
    """dw/dt = (v - w) (v + v_s) / L with v at rest and fast, against an integrator."""
    law = SlidingLaw(0.8, 0.4, 1.5, 0.2)
    for speed, step_s in ((0.0, 0.3), (0.7, 0.1), (9.0, 0.02)):
        start = np.array([0.0, 2.5])
        found = law.mean_after(start, np.full(2, speed * step_s), step_s)
        true = solve_ivp(
            lambda _, w, v=speed: (v - w) * (v + 1.5) / 0.2, (0, step_s), start, rtol=1e-10
        )
        np.testing.assert_allclose(found, true.y[:, -1], rtol=1e-6, atol=1e-8)
    assert (law.mean_after(start, np.ones(2), 0.0) == start).all()
    np.testing.assert_allclose(law.coefficient(np.array([0.0, 1.5, 1e9])),
                               [0.8, 0.4 + 0.4 / np.e, 0.4])  # fmt: skip


@pytest.mark.parametrize("law", [FALLS, RISES], ids=["falls", "rises"])
@pytest.mark.parametrize("speed_mm_s", [0.5, 4.0])
def test_steady_sliding_has_the_friction_of_its_speed(law: SlidingLaw, speed_mm_s: float) -> None:
    """Before it, a friction that falls passes a peak nearer to that of rest."""
    found = [ratio(s) for s in solved(law, dragged(speed_mm_s, 3.0))[1:]]
    wanted = float(law.coefficient(np.array([speed_mm_s]))[0])
    assert found[-1] == pytest.approx(wanted, rel=0.03)
    assert (max(found) > wanted + 0.15 * (0.8 - wanted)) == (law is FALLS)
    assert max(found) < 0.8


def test_a_contact_at_rest_forgets_its_speed():
    """After some L / v_s of rest the coefficient is that of rest again."""
    moves = dragged(4.0, 3.0)
    poses = (*moves, *(Pose(moves[-1].time_s + t, 3.0, 0.0, 0.3) for t in (0.3, 3.0)))
    found = solved(FALLS, poses)
    fast, resting, rested = (mean_slip_mm_s(s)[s.touch > 0] for s in found[-3:])
    np.testing.assert_allclose(np.median(fast), 4.0, rtol=0.1)
    np.testing.assert_allclose(resting.max(), fast.max() * np.exp(-2.0 * 0.3 / 0.6), rtol=0.1)
    assert rested.max() < 1e-3


@pytest.mark.slow
def test_the_error_falls_with_the_step():
    """In the first order, where friction rises with the speed and sliding is stable."""
    poses = dragged(2.0, 1.0, 5)
    fine = [ratio(s) for s in solved(RISES, poses, 1 / 96)[1:]]
    shares = (1 / 3, 1 / 6, 1 / 12)
    errors = [
        max(abs(ratio(s) - f) for s, f in zip(solved(RISES, poses, share)[1:], fine, strict=True))
        for share in shares
    ]
    assert 0.6 < np.polyfit(np.log(shares), np.log(errors), 1)[0] < 1.6
    assert errors[-1] < 2.5 * shares[-1] * 0.3


def test_with_one_coefficient_it_is_the_contact_of_coulomb_bit_for_bit():
    law = SlidingLaw(0.6, 0.6, 1.0, 0.1)
    moves = dragged(1.0, 0.6, 3)
    poses = (*moves, replace(moves[-1], time_s=9.0), replace(moves[-1], time_s=9.5, x_mm=0.4))
    plain = ContactSolver(pad(), BALL, settings(law)).states(poses)
    for one, other in zip(solved(law, poses), plain, strict=True):
        assert one.force_n.tobytes() == other.force_n.tobytes()
        assert one.displacement_mm.tobytes() == other.displacement_mm.tobytes()


def test_the_contact_must_know_the_coefficient_at_rest():
    with pytest.raises(ContactError, match=r"0\.8 in the law of sliding and 0\.5"):
        SlidingContact(pad(), BALL, settings(RISES), FALLS)
