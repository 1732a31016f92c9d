"""A viscoelastic gel in contact against closed forms and against sums over the whole history."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from contact_pads import dense_compliance, small_pad
from numpy.typing import NDArray
from scipy.optimize import brentq, nnls

from gelslim_twin.contact.fine_contact import FineContact
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.prony import PronySeries
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.contact.viscoelastic_contact import ViscoelasticContact
from gelslim_twin.scene.indenter import FlatPunch, Indenter, Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.compliance.convolved import ConvolvedCompliance

Array = NDArray[np.float64]
RADIUS_MM, DEPTH_MM = 8.0, 0.3
FRACTION, TIME_S = 0.4, 0.3
ONE = PronySeries((FRACTION,), (TIME_S,))
TWO = PronySeries((0.4, 0.2), (0.3, 3.0))
BALL = Sphere(shape="sphere", radius_mm=RADIUS_MM)
# Its sides lie between the rows of nodes.
PUNCH = FlatPunch(shape="flat_punch", length_mm=5.0, width_mm=3.0)


@cache
def pad(cells: int = 12) -> SurfaceCompliance:
    return SurfaceCompliance(small_pad(0.3, cells, 2, 12.0, 2.0))


def elastic(shape: Indenter = BALL, friction: float = 0.0, cells: int = 12) -> ContactSolver:
    """Contact of small displacements, as the closed forms have it."""
    settings = ContactSettings(1e-7, friction, geometry="rest")
    return ContactSolver(pad(cells), Tool.of([shape], Path()), settings)


def path(times: Array, depths: Array, x: Array | float = 0.0) -> tuple[Pose, ...]:
    places = np.broadcast_to(x, np.shape(times))
    return tuple(
        Pose(time_s=float(t), depth_mm=float(d), x_mm=float(a))
        for t, d, a in zip(times, depths, places, strict=True)
    )


def solved(series: PronySeries, poses: tuple[Pose, ...], **given: object) -> list[GelState]:
    return list(ViscoelasticContact(elastic(**given), series).states(poses))  # type: ignore[arg-type]


def push(states: list[GelState]) -> Array:
    return np.array([-s.force_n[:, 2].sum() for s in states])


def modulus(series: PronySeries, time_s: Array | float) -> Array:
    terms = zip(series.fractions, series.times_s, strict=True)
    return 1 - sum(g * (1 - np.exp(-np.asarray(time_s) / tau)) for g, tau in terms)


def creep(time_s: Array | float) -> Array:
    """J(t) of the single term, from J(s) g(s) = 1 / s²."""
    left = 1 - FRACTION
    return (1 - FRACTION * np.exp(-left * np.asarray(time_s) / TIME_S)) / left


@cache
def elastic_push(cells: int = 12) -> tuple[Array, Array]:
    """Depths and forces of an elastic pad."""
    depths = np.linspace(0, DEPTH_MM, 61)
    return depths, push(list(elastic(cells=cells).states(path(np.arange(61.0), depths))))


def ting(time_s: float, cells: int) -> float:
    """Force of a ball that goes down for 1 s and up for 1 s, by Ting (1968).

    While the contact recedes it is that of the earlier time t1 of the same size, at which the
    integral of g(t - s) d(depth) from t1 to t vanishes, and the history after t1 does not count.
    """
    whole = np.linspace(0, time_s, 4001)
    rate = np.where(whole < 1, 1.0, -1.0) * modulus(TWO, time_s - whole)

    def later(first: float) -> float:
        at = np.linspace(first, time_s, 2001)
        return float(np.trapezoid(np.interp(at, whole, rate), at))

    if time_s > 1 and later(0.0) <= 0:
        return 0.0
    same = time_s if time_s <= 1 else float(brentq(later, 0.0, 1.0))
    depths, forces = elastic_push(cells)
    edges = np.linspace(0, same, 2001)
    change = np.diff(np.interp(edges * DEPTH_MM, depths, forces))
    return float((modulus(TWO, time_s - (edges[1:] + edges[:-1]) / 2) * change).sum())


def triangle(steps: int) -> tuple[Pose, ...]:
    """Down for 1 s and up for 1 s, in `steps` each."""
    times = np.linspace(0, 2, 2 * steps + 1)
    return path(times, DEPTH_MM * np.minimum(times, 2 - times))


def test_a_ball_pressed_and_raised_gives_the_force_of_ting():
    poses = triangle(10)
    expected = np.array([ting(p.time_s, 12) for p in poses])
    assert (expected[-3:] == 0).all()
    assert expected[15] > 0.05 * expected.max()
    np.testing.assert_allclose(push(solved(TWO, poses)), expected, atol=4e-3 * expected.max())


@pytest.mark.slow
def test_the_error_falls_with_the_square_of_the_step():
    """Against Ting on 24 x 24 cells; the mesh and the table of elastic forces leave 1e-4."""
    errors, counts = [], (3, 5, 10)
    for steps in counts:
        poses = triangle(steps)
        expected = np.array([ting(p.time_s, 24) for p in poses])
        found = push(solved(TWO, poses, cells=24))
        errors.append(np.sqrt(np.mean((found - expected) ** 2)) / expected.max())
    slope = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert -2.6 < slope < -1.6
    assert errors[-1] < 7e-4


def test_at_a_constant_force_the_contact_grows_as_the_creep_function():
    """Lee and Radok (1960): the elastic force at the present depth is P J(t)."""
    depths, forces = elastic_push()
    times = np.concatenate([[0.0], np.linspace(0, 1, 21) ** 2])
    hold = 0.5 * forces[-1]
    wanted = hold * creep(times)
    wanted[0] = 0.0
    sunk = np.interp(wanted, forces, depths)
    found = solved(ONE, path(times, sunk))
    assert wanted[-1] > 1.5 * hold
    np.testing.assert_allclose(push(found)[1:], hold, rtol=3e-3)
    assert (found[-1].touch > 0).sum() > (found[1].touch > 0).sum()


def test_what_is_held_relaxes_as_the_modulus_with_friction_too():
    times = np.array([0.0, 0.0, 0.0, 0.1, 0.5, 2.0, 30.0])
    x = np.array([0.0, 0.0, 0.1, 0.1, 0.1, 0.1, 0.1])
    held = solved(TWO, path(times, np.where(np.arange(7) > 0, DEPTH_MM, 0.0), x), friction=0.4)
    for state in held[3:]:
        assert ((state.touch > 0) == (held[2].touch > 0)).all()
    first = held[2].force_n
    for time_s, state in zip(times[3:], held[3:], strict=True):
        np.testing.assert_allclose(
            state.force_n, modulus(TWO, time_s) * first, atol=1e-5 * np.abs(first).max()
        )


def test_a_released_surface_recovers_as_the_creep_function():
    """Held for a time T and let go: u g1 (1 - exp(-T / tau)) exp(-(1 - g1) t / tau)."""
    after = np.linspace(0, 0.8, 41)
    times = np.concatenate([[0.0, 0.0, 0.4], 0.4 + after])
    depths = np.concatenate([[0.0, DEPTH_MM, DEPTH_MM], np.full(41, -0.1)])
    found = solved(ONE, path(times, depths))
    held = found[2].displacement_mm
    dent = FRACTION * -np.expm1(-0.4 / TIME_S) * np.exp(-(1 - FRACTION) * after / TIME_S)
    assert 0.25 < dent[0] < 0.35
    for share, state in zip(dent, found[3:], strict=True):
        assert not state.touch.any()
        assert not state.force_n.any()
        np.testing.assert_allclose(state.displacement_mm, share * held, atol=2e-5 * DEPTH_MM)


def test_a_ball_comes_back_to_the_dent_and_not_to_the_gel_at_rest():
    """Pressed to half of the dent that it has just left, it touches nothing."""
    times = np.array([0.0, 0.0, 30.0, 30.0, 30.0, 30.0])
    found = solved(TWO, path(times, np.array([0, 0.3, 0.3, -0.1, 0.09, 0.24])))
    assert 0.6 * 0.3 > 0.09
    assert not found[4].touch.any()
    assert found[5].touch.any()


def small_cycles(radians: float, count: int) -> tuple[Array, Array]:
    """Depths and forces of a flat punch over the last of four periods of `count` steps each."""
    times = np.linspace(0, 4, 4 * count + 1) * 2 * np.pi / radians
    depths = 0.1 + 0.005 * np.sin(radians * times)
    found = solved(ONE, path(np.concatenate([[0.0], times]), np.concatenate([[0.0], depths])),
                   shape=PUNCH)  # fmt: skip
    assert all((s.touch > 0).sum() == (found[1].touch > 0).sum() for s in found[1:])
    return depths[-count - 1 :], push(found)[-count - 1 :]


@pytest.mark.parametrize("ratio", [0.3, 3.0])
def test_a_small_cycle_dissipates_what_the_loss_modulus_says(ratio: float) -> None:
    """π ε² S g'', with g'' = g1 ωτ / (1 + ω²τ²) and S the stiffness of the elastic contact."""
    depths, forces = small_cycles(ratio / TIME_S, 40)
    lost = float(np.trapezoid(forces, depths))
    stiffness = push(list(elastic(PUNCH).states(path(np.zeros(2), np.array([0, 0.1])))))[-1] / 0.1
    loss = FRACTION * ratio / (1 + ratio**2)
    # What is left of the start, and chords in place of a circle: under one per cent.
    assert lost == pytest.approx(np.pi * 0.005**2 * stiffness * loss, rel=0.01)


@pytest.mark.slow
def test_no_closed_path_gives_energy():
    """Random presses from no contact to no contact, at random speeds."""
    random = np.random.default_rng(5)
    for _ in range(3):
        times = np.concatenate([[0.0], np.cumsum(random.uniform(0.01, 0.5, 24))])
        depths = np.concatenate([[-0.02], random.uniform(0.0, DEPTH_MM, 23), [-0.02]])
        fine = np.linspace(0, times[-1], 6 * len(times))
        depths = np.interp(fine, times, depths)
        forces = push(solved(TWO, path(fine, depths)))
        work = np.cumsum((forces[1:] + forces[:-1]) / 2 * np.diff(depths))
        assert work.min() > -1e-3 * work.max()
        assert work[-1] > 0.05 * work.max()


def from_whole_history(poses: tuple[Pose, ...]) -> tuple[Array, Array]:
    """Forces (t, n) and motions along z by u = C sum of J (t - s) df(s), without recursion.

    At each time the laws of contact are those of a least-squares problem in positive forces.
    """
    points = pad().bundle.mesh.surface_mm
    c = dense_compliance(pad().bundle)[2::3, 2::3]
    half = np.linalg.cholesky(c)
    times = np.array([p.time_s for p in poses])
    forces, motions = np.zeros((len(poses), len(c))), np.zeros((len(poses), len(c)))
    for n in range(1, len(poses)):
        parts = np.linspace(times[:n], times[1 : n + 1], 41)
        means = np.trapezoid(creep(times[n] - parts), dx=1 / 40, axis=0)
        past = (means[:-1, None] * np.diff(forces[:n], axis=0)).sum(axis=0)
        known = c @ (past - means[-1] * forces[n - 1])
        pose = poses[n]
        away = (points[:, 0] - pose.x_mm) ** 2 + (points[:, 1] - pose.y_mm) ** 2
        height = RADIUS_MM - np.sqrt(RADIUS_MM**2 - np.minimum(away, RADIUS_MM**2))
        room = height - pose.depth_mm - known
        # min x'Cx/2 + room x over x >= 0 for x = -J f.
        x, _ = nnls(half.T, -np.linalg.solve(half, room))
        forces[n] = -x / means[-1]
        motions[n] = known + means[-1] * c @ forces[n]
    return forces, motions


@pytest.mark.slow
def test_a_path_agrees_with_the_sum_over_its_whole_history():
    """A ball that presses, slides off its dent, rises and comes back; both err with the step."""
    corners = np.array([[0, 0, 0], [0.3, 0, 0.3], [0.8, 1.5, 0.3], [1.0, 1.5, -0.02],
                        [1.3, 0.5, 0.25], [1.4, 0.5, 0.1]])  # fmt: skip
    apart = []
    for steps in (28, 56):
        times = np.linspace(0, 1.4, steps + 1)
        x, depth = (np.interp(times, corners[:, 0], corners[:, k]) for k in (1, 2))
        poses = path(times, depth, x)
        forces, motions = from_whole_history(poses)
        found = solved(ONE, poses)
        force = np.stack([s.force_n[:, 2] for s in found]) - forces
        motion = np.stack([s.displacement_mm[:, 2] for s in found]) - motions
        apart.append((np.abs(force).max() / np.abs(forces).max(), np.abs(motion).max() / DEPTH_MM))
    assert max(apart[-1]) < 1e-4
    assert (np.array(apart[1]) < 0.35 * np.array(apart[0])).all()


def test_without_terms_the_gel_is_elastic_bit_for_bit():
    poses = path(
        np.arange(5.0), np.array([0, 0.2, 0.3, 0.1, -0.1]), np.array([0, 0, 0.2, 0.2, 0.2])
    )
    for series in (PronySeries(), PronySeries((0.0,), (1.0,))):
        found = solved(series, poses, friction=0.3)
        for state, plain in zip(found, elastic(friction=0.3).states(poses), strict=True):
            assert state.force_n.tobytes() == plain.force_n.tobytes()
            assert state.displacement_mm.tobytes() == plain.displacement_mm.tobytes()


@pytest.mark.slow
def test_a_pad_without_a_table_of_columns_gives_the_same():
    poses = path(np.array([0.0, 0.3, 0.6, 0.7]), np.array([0, 0.3, 0.15, -0.1]))
    settings, tool = ContactSettings(1e-6, 0.0), Tool.of([BALL], Path())
    bundle = small_pad(0.3, 12, 2, 12.0, 2.0)
    fine, table = (
        ViscoelasticContact(solver, TWO).states(poses)
        for solver in (
            FineContact(ConvolvedCompliance(bundle), tool, settings),
            ContactSolver(pad(), tool, settings),
        )
    )
    for one, other in zip(fine, table, strict=True):
        np.testing.assert_allclose(one.force_n, other.force_n, atol=1e-6)
        np.testing.assert_allclose(one.displacement_mm, other.displacement_mm, atol=2e-5)
