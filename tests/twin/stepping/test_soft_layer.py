"""Bodies with a soft layer: two elastic layers in series, Hertz, and steps of the twin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from contact_pads import YOUNGS_MPA, dense_compliance, small_pad
from stepping_rig import DT_S, Array, at, linear_twin, pad_folder, turned
from test_stiffness import EXACT, assert_derivative

from gelslim_force.layer.ball_on_layer import BallOnLayer
from gelslim_twin.contact.contact_forces import solve_contact_forces
from gelslim_twin.contact.soft_layer import SoftLayer
from gelslim_twin.scene.indenter import Cylinder
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.step_error import StepError


def ball_force_n(layers: list[SoftLayer], side_mm: float, radius: float, depth: float) -> float:
    """Force of a rigid ball on layers in series, from two meshes by the square of their pitch."""
    found = []
    for count in (13, 21):
        pitch = side_mm / (count - 1)
        grid = np.stack(np.meshgrid(*[np.arange(count)] * 2, indexing="ij"), -1).reshape(-1, 2)
        way = grid[:, None] - grid[None] + count - 1
        table = sum(layer.table((pitch, pitch), (count, count)) for layer in layers)
        block = np.asarray(table)[way[..., 0], way[..., 1]].transpose(0, 2, 1, 3)
        away = np.hypot(*((grid - (count - 1) / 2) * pitch).T)
        height = radius - depth - np.sqrt(radius**2 - away**2)
        flat: Array = block.reshape(3 * count**2, -1)
        np.testing.assert_allclose(flat, flat.T, atol=1e-12 * flat.max())
        forces = solve_contact_forces(flat, height, np.zeros((count**2, 2)), 0.0)
        found.append(-float(forces.force_n[:, 2].sum()))
    ratio = (20 / 12) ** 2
    return found[1] + (found[1] - found[0]) / (ratio - 1)


@pytest.mark.parametrize(("poisson", "thickness"), [(0.3, 2.0), (0.45, 1.0)])
def test_a_layer_is_as_stiff_as_its_solution(poisson: float, thickness: float) -> None:
    known = BallOnLayer.at(1.1, 5.0, thickness, poisson)
    force = ball_force_n([SoftLayer(0.3, poisson, thickness)], 2.8, 5.0, known.depth_mm)
    assert force == pytest.approx(0.3 * known.force_n_per_mpa, rel=0.015)


def test_two_layers_in_series() -> None:
    """The same layer twice is one of half the modulus, and of two thick ones 1/E* is the sum."""
    layer, half = SoftLayer(0.3, 0.4, 1.5), SoftLayer(0.15, 0.4, 1.5)
    one, two = (ball_force_n(layers, 2.8, 5.0, 0.2) for layers in ([half], [layer, layer]))
    assert two == pytest.approx(one, rel=1e-9)


@pytest.mark.slow
def test_a_pair_of_thick_layers_is_that_of_hertz() -> None:
    radius, contact, thick = 4.0, 0.8, 30.0
    depth = contact**2 / radius
    moduli = (0.2, 0.3), (0.6, 0.45)
    pair = 1 / sum((1 - nu**2) / youngs for youngs, nu in moduli)
    force = ball_force_n([SoftLayer(e, nu, thick) for e, nu in moduli], 2.0, radius, depth)
    # The finite thickness of both adds 1.13 a/h at most (Dimitriadis et al. 2002).
    hertz = 4 / 3 * pair * np.sqrt(radius) * depth**1.5
    assert hertz < force < hertz * (1 + 1.2 * contact / thick + 0.01)


def test_a_hard_layer_is_a_rigid_body_and_a_soft_one_gives_way(pad: Path) -> None:
    forces = []
    for body in (
        Body.sphere(8.0),
        Body.sphere(8.0).with_layer(1e5, 1.0),
        Body.sphere(8.0).with_layer(YOUNGS_MPA, 2.0, 0.32),
    ):
        twin = linear_twin(pad, force=EXACT)
        twin.add(body)
        step = twin.step(at(0, 0, 7.6), DT_S)
        forces.append(-step.wrench[2])
    assert forces[1] == pytest.approx(forces[0], rel=1e-3)
    # Equal layers in series have half the stiffness; one has the mesh of the gel, one has not.
    assert forces[2] == pytest.approx(forces[0] / 2, rel=0.06)


def test_the_gel_moves_by_its_own_compliance_alone(tmp_path: Path) -> None:
    folder = pad_folder(tmp_path, poisson=0.32, cells=12)
    twin = linear_twin(folder, friction=0.5)
    twin.add(Body.sphere(4.0).with_layer(0.3, 1.0))
    twin.step(at(0, 0, 3.85), DT_S)
    step = twin.step(at(0.1, 0, 3.8), DT_S)
    moved = dense_compliance(small_pad(0.32, 12, 3)) @ step.force_n.reshape(-1)
    assert abs(step.wrench[0]) > 0.01 * -step.wrench[2]
    np.testing.assert_allclose(step.displacement_mm.reshape(-1), moved, atol=1e-6)


def test_a_cable_presses_less_than_a_rod_and_its_derivative_is_exact(pad: Path) -> None:
    rod = Body.from_indenters(Cylinder(shape="cylinder", radius_mm=1.5, length_mm=6.0))
    forces = []
    for body in (rod, rod.with_layer(0.05, 1.0, 0.3)):
        twin = linear_twin(pad, force=EXACT, friction=0.5)
        twin.add(body)
        twin.step(at(0, 0.1, -0.1, turned("z", 20.0)), DT_S)
        pose = at(0.03, 0.12, -0.13, turned("z", 20.3))
        forces.append(-twin.step(pose, DT_S).wrench[2])
    assert 0.3 * forces[0] < forces[1] < 0.8 * forces[0]
    ball = linear_twin(pad, force=EXACT, friction=0.5)
    ball.add(Body.sphere(4.0).with_layer(0.5, 0.6))
    ball.step(at(0.1, 0.05, 3.8), DT_S)
    assert assert_derivative(ball, at(0.13, 0.07, 3.78))


def test_layers_that_are_refused(pad: Path) -> None:
    for bad in ((0.0, 1.0), (0.3, -1.0), (0.3, 1.0, 0.5), (np.nan, 1.0)):
        with pytest.raises(StepError, match="body sphere"):
            Body.sphere(4.0).with_layer(*bad)
    twin = linear_twin(pad)
    twin.add(Body.sphere(4.0).with_layer(0.3, 1.0))
    with pytest.raises(StepError, match="only body"):
        twin.add(Body.sphere(2.0))
