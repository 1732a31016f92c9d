"""Nearly incompressible gel at large strain: pressures taken ahead, and presses that need them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from contact_pads import small_pad
from tool_height import tool_height_mm

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.nonlinear import NonlinearContact
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.elements.material import Material
from ifem_export.finite_strain.neo_hookean import NeoHookeanPad
from ifem_export.mesh.pad_mesh import PadMesh

MATERIAL = Material(0.147, 0.4999, 1000.0)
SPHERE = Sphere(shape="sphere", radius_mm=6)


def pad() -> NeoHookeanPad:
    return NeoHookeanPad(
        PadMesh.from_occupancy(np.ones((2, 2, 2), dtype=bool), (0.5, 0.6, 0.4), (0.0, 0.0, -0.8)),
        MATERIAL,
    )


def wobble(size: float, seed: int = 5) -> np.ndarray:
    return size * np.random.default_rng(seed).standard_normal((pad().n_nodes, 3))


def test_pressure_of_a_stretched_block() -> None:
    """κ (J - 1) of an even stretch, and its first order in a further one."""
    one, shear = pad(), np.array([[1.1, 0.2, 0.0], [0.0, 0.95, 0.1], [0.0, 0.0, 1.02]])
    z, y, x = np.unravel_index(one.mesh.numbering.positions[np.arange(one.n_nodes)],
                               one.mesh.numbering.shape)  # fmt: skip
    corners = np.column_stack([x, y, z]) * one.mesh.cell_size_mm
    u = corners @ (shear - np.eye(3)).T
    bulk = MATERIAL.bulk_modulus_mpa
    still = one.predicted_pressure_mpa(u, np.zeros_like(u))
    np.testing.assert_allclose(still, bulk * (np.linalg.det(shear) - 1), rtol=1e-9)
    more = 1e-6 * corners
    ahead = one.predicted_pressure_mpa(u, more)
    swollen = np.linalg.det(shear + 1e-6 * np.eye(3)) - 1
    np.testing.assert_allclose(
        (ahead - still) / bulk, swollen - np.linalg.det(shear) + 1, rtol=1e-4
    )


def test_tangent_under_a_given_pressure() -> None:
    """Its own is the plain tangent; another adds the pressure times the change of the volume."""
    one, u = pad(), wobble(0.02)
    own = one.predicted_pressure_mpa(u, np.zeros_like(u))
    plain = one.tangent(u).toarray()
    np.testing.assert_allclose(one.tangent(u, own).toarray(), plain, atol=1e-9 * plain.max())
    other = own + np.linspace(-1, 2, len(own))
    change = one.tangent(u, other).toarray() - plain
    way, small, volume = wobble(1.0, 6), 1e-5, float(np.prod(one.mesh.cell_size_mm))
    slopes = []
    for sign in (1, -1):
        at = u + sign * small * way
        slope = np.zeros(3 * one.n_nodes)
        for k in range(len(slope)):
            step = np.zeros(len(slope))
            step[k] = 1.0
            gain = one.predicted_pressure_mpa(at, step.reshape(-1, 3)) - one.predicted_pressure_mpa(
                at, np.zeros_like(u)
            )
            slope[k] = ((other - own) * gain).sum() * volume / MATERIAL.bulk_modulus_mpa
        slopes.append(slope)
    expected = (slopes[0] - slopes[1]) / (2 * small)
    found = change @ way.reshape(-1)
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


DEPTHS_MM = (0.0, 0.1, 0.2, 0.3, 0.6, 0.9, 1.05, -0.1)
"""From 0.3 mm on in steps of 15 % of the thickness."""
MOST_STEPS, TOLERANCE = 10, 3e-3
FRICTIONS = (0.0, 0.5)


@cache
def pressed(friction: float) -> NonlinearContact:
    """The gel under a ball."""
    compliance = SurfaceCompliance(small_pad(0.4999))
    solver = ContactSolver(compliance, Tool.of([SPHERE], Path()), ContactSettings(1e-3, friction))
    return NonlinearContact(solver, TOLERANCE)


def poses_off_by(size: float, seed: int = 0) -> tuple[Pose, ...]:
    """The ball's way down and up, every number off by a part of it or by so many mm."""
    noise = size * np.random.default_rng(seed).standard_normal((len(DEPTHS_MM), 3))
    return tuple(
        Pose(time_s=k, depth_mm=depth * (1 + off[0]), x_mm=off[1], y_mm=off[2])
        for k, (depth, off) in enumerate(zip(DEPTHS_MM, noise, strict=True))
    )


def iterations(states: list[GelState]) -> list[float]:
    """Of each pose that touches."""
    return [state.solver["iterations"] for state in states[1:-1]]


def pushes_n(states: list[GelState]) -> np.ndarray:
    """Of each pose that touches."""
    return np.array([-state.force_n[:, 2].sum() for state in states[1:-1]])


@pytest.mark.parametrize("friction", FRICTIONS)
def test_pressed_to_half_in_a_few_steps(friction: float) -> None:
    """Forces balance, nodes are on the ball, few steps do."""
    model, poses = pressed(friction), poses_off_by(0.0)
    states = list(model.states(poses))
    for pose, state in zip(poses[4:-1], states[4:-1], strict=True):
        assert state.solver["residual"] <= TOLERANCE
        places = model.solver.points_mm + state.displacement_mm
        height = tool_height_mm(model.solver.tool, pose, places[:, 0], places[:, 1])
        assert (height - places[:, 2]).min() > -3e-3
        assert np.abs(height - places[:, 2])[state.touch > 0].max() < 3e-3
    assert max(iterations(states)) <= MOST_STEPS
    assert (np.diff(pushes_n(states)) > 0).all()
    assert not states[-1].force_n.any()


@pytest.mark.slow
@pytest.mark.parametrize("friction", [pytest.param(0.0, marks=pytest.mark.slow), 0.5])
def test_rounding_does_not_decide_how_many_steps_it_takes(friction: float) -> None:
    """Poses off by some hundred roundings: as few steps, and forces off by as little."""
    model = pressed(friction)
    forces = pushes_n(list(model.states(poses_off_by(0.0))))
    for seed in range(4):
        states = list(model.states(poses_off_by(1e-13, seed)))
        assert max(iterations(states)) <= MOST_STEPS
        np.testing.assert_allclose(pushes_n(states), forces, rtol=1e-6)
