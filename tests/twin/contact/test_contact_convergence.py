"""Sweeps end when the forces are as near as they say; Newton's steps and warm starts save some."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from gelslim_twin.contact.contact_forces import (
    FREE,
    SLIP,
    STICK,
    lcp_forces,
    solve_contact_forces,
)

Array = NDArray[np.float64]


def coupled(share: float) -> Array:
    """Two nodes, each moved by the other by a share of its own motion."""
    return np.kron(np.array([[1.0, share], [share, 1.0]]), np.eye(3))


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4, 1e-6])
@pytest.mark.parametrize("share", [0.6, 0.8, 0.9, 0.93])
def test_the_error_of_sweeps_is_estimated_from_their_rate(share: float, tolerance: float) -> None:
    """Two sticking nodes converge by a known rate: neither too early nor many sweeps too late."""
    height, target = np.array([-1.0, -0.95]), np.array([[0.03, 0.01], [-0.02, 0.02]])
    motion = np.column_stack([target, height]).reshape(-1)
    true = np.linalg.solve(coupled(share), motion)
    found = solve_contact_forces(coupled(share), height, target, 1e3, tolerance=tolerance)
    error = np.linalg.norm(found.force_n.reshape(-1) - true) / np.linalg.norm(true)
    assert 0.4 * tolerance < error < tolerance
    assert (found.touch == STICK).all()
    # Every sweep lowers the error by the share.
    assert found.sweeps == pytest.approx(np.log(error) / np.log(share), abs=12)


def test_a_quick_rate_is_not_trusted_beyond_one_half() -> None:
    height, target = np.array([-1.0, -0.95]), np.zeros((2, 2))
    motion = np.column_stack([target, height]).reshape(-1)
    true = np.linalg.solve(coupled(0.3), motion)
    found = solve_contact_forces(coupled(0.3), height, target, 1e3, tolerance=1e-4)
    error = np.linalg.norm(found.force_n.reshape(-1) - true) / np.linalg.norm(true)
    # The change of the last sweep is the bound, of which the next would leave three tenths.
    assert 0.05 * 1e-4 < error < 0.3 * 1e-4


def smooth_compliance(count: int) -> tuple[Array, Array]:
    """Nodes at random places, so smoothly coupled that sweeps converge slowly."""
    places = np.random.default_rng(1).uniform(-1, 1, (count, 2))
    apart = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    return np.kron(np.exp(-(apart**2) / 2) + 1e-2 * np.eye(count), np.eye(3)), places


@pytest.mark.parametrize("friction", [0.2, 0.4, 0.6])
def test_newtons_method_takes_over_where_sweeps_are_slow(friction: float) -> None:
    """The tolerance is met by far, in as many sweeps whatever it is."""
    compliance, _ = smooth_compliance(12)
    height, target = np.full(12, -0.3), np.full((12, 2), 0.1)
    sweeps = []
    for tolerance in (1e-3, 1e-6):
        found = solve_contact_forces(compliance, height, target, friction, tolerance=tolerance)
        assert found.residual < 1e-9
        sweeps.append(found.sweeps)
        assert set(found.touch) == {FREE, STICK if friction > 0.5 else SLIP}
    assert sweeps[0] == sweeps[1] <= 60


@pytest.mark.parametrize("friction", [0.3, 1.0])
def test_a_start_at_the_answer_is_the_answer(friction: float) -> None:
    compliance, places = smooth_compliance(10)
    height, target = 0.1 * (places**2).sum(axis=1) - 0.1, np.full((10, 2), 0.02)
    cold = solve_contact_forces(compliance, height, target, friction, tolerance=1e-8)
    for start_mm in (None, cold.motion_mm):
        warm = solve_contact_forces(
            compliance, height, target, friction, cold.force_n, 1e-5, start_mm=start_mm
        )
        assert warm.sweeps <= 3
        np.testing.assert_allclose(warm.force_n, cold.force_n, atol=1e-6)
        np.testing.assert_allclose(
            warm.motion_mm.reshape(-1), compliance @ warm.force_n.reshape(-1), atol=1e-12
        )


def test_a_node_beyond_the_tool_loses_the_force_it_started_with() -> None:
    compliance, _ = smooth_compliance(6)
    height, start = np.full(6, -0.2), np.full((6, 3), -0.1)
    height[2] = np.inf
    zero = np.zeros((6, 2))
    moved = (compliance @ start.reshape(-1)).reshape(-1, 3)
    found = solve_contact_forces(compliance, height, zero, 0.4, start, 1e-9, start_mm=moved)
    cold = solve_contact_forces(compliance, height, zero, 0.4, tolerance=1e-9)
    assert not found.force_n[2].any()
    np.testing.assert_allclose(found.force_n, cold.force_n, atol=1e-7)
    np.testing.assert_allclose(
        found.motion_mm.reshape(-1), compliance @ found.force_n.reshape(-1), atol=1e-12
    )


def tilted(seed: int) -> tuple[Array, Array, Array]:
    """A random compliance, frames of any direction and heights of both signs."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((24, 24))
    frames = Rotation.random(8, random_state=seed).as_matrix()
    return root @ root.T / 8 + np.eye(24), frames, rng.uniform(-1.0, 0.4, 8)


@pytest.mark.parametrize("seed", range(5))
def test_frictionless_forces_are_the_least_energy_along_their_normals(seed: int) -> None:
    """Against non-negative least squares; the report is that of a solution to rounding."""
    compliance, frames, height = tilted(seed)
    spread = np.zeros((24, 8))
    for k, normal in enumerate(frames[:, :, 2]):
        spread[3 * k : 3 * k + 3, k] = normal
    across = spread.T @ compliance @ spread
    lower = np.linalg.cholesky(across)
    push, _ = nnls(lower.T, np.linalg.solve(lower, -height))
    found = solve_contact_forces(compliance, height, np.zeros((8, 2)), 0.0, frames=frames)
    np.testing.assert_allclose(found.force_n.reshape(-1), -spread @ push, atol=1e-9)
    np.testing.assert_allclose(
        found.motion_mm.reshape(-1), compliance @ found.force_n.reshape(-1), atol=1e-12
    )
    assert list(found.touch) == [SLIP if p > 1e-9 else FREE for p in push]
    assert found.residual < 1e-12
    again = solve_contact_forces(
        compliance, height, np.zeros((8, 2)), 0.0, found.force_n, frames=frames
    )
    assert again.sweeps == 1


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("friction", [0.3, 0.8])
def test_frictional_forces_obey_the_law_in_their_frames(seed: int, friction: float) -> None:
    compliance, frames, height = tilted(seed)
    target = 0.2 * np.random.default_rng(seed).standard_normal((8, 2))
    found = solve_contact_forces(
        compliance, height, target, friction, tolerance=1e-9, frames=frames
    )
    force = np.einsum("kab,ka->kb", frames, found.force_n)
    moved = np.einsum("kab,ka->kb", frames, found.motion_mm)
    side, on = np.hypot(*force[:, :2].T), found.touch > 0
    slip = moved[:, :2] - target
    np.testing.assert_allclose(
        found.motion_mm.reshape(-1), compliance @ found.force_n.reshape(-1), atol=1e-9
    )
    assert not force[~on].any()
    assert (moved[~on, 2] <= height[~on] + 1e-7).all()
    np.testing.assert_allclose(moved[on, 2], height[on], atol=1e-6)
    sticks, slips = found.touch == STICK, found.touch == SLIP
    np.testing.assert_allclose(slip[sticks], 0.0, atol=1e-6)
    np.testing.assert_allclose(side[slips], -friction * force[slips, 2], rtol=1e-6)
    far = np.hypot(*slip[slips].T)
    along = (slip[slips] * force[slips, :2]).sum(axis=1)
    np.testing.assert_allclose(along, -side[slips] * far, atol=1e-6)


def test_the_active_set_is_found_in_few_factorisations() -> None:
    """From nothing, from everything and from the answer."""
    rng = np.random.default_rng(7)
    places = np.linspace(-1, 1, 40)
    normal = np.exp(-4 * np.abs(places[:, None] - places)) + 0.1 * np.eye(40)
    height = places**2 - 0.3 + 0.01 * rng.standard_normal(40)
    height[3] = np.inf
    push, factors = lcp_forces(normal, height, np.zeros(40, dtype=bool))
    assert 2 <= factors <= 8
    assert push[3] == 0
    for guess, most in ((push < 0, 1), (np.ones(40, dtype=bool), 8)):
        again, factors = lcp_forces(normal, height, guess)
        np.testing.assert_allclose(again, push, atol=1e-12)
        assert factors <= most


def test_a_touch_of_rounding_has_no_force_and_no_residual() -> None:
    """A depth of a hundred-trillionth of the other heights decides nothing."""
    found = solve_contact_forces(coupled(0.5), np.array([-1e-14, 1.0]), np.zeros((2, 2)), 0.0)
    assert not found.force_n.any()
    assert (found.residual, list(found.touch)) == (0.0, [FREE, FREE])
