"""Forces from noisy motion: the mask and cone against raw condensation, resultants kept."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.sparse.linalg import LinearOperator, eigsh

from ifem_export.elements.material import Material
from ifem_export.errors import IfemError
from ifem_export.inverse.contact_fit_kernel import project
from ifem_export.inverse.contact_inverse import (
    MARGIN,
    _Fit,
    _largest_eigenvalue,
    _projected,
    masked_force,
    smoothing,
)
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh
from ifem_export.operators.surface_operator import surface_operator

NOISE_MM = 0.02


class Press:
    """A 2 N press with shear, the motion it makes and what the operators say of it."""

    def __init__(self, nu: float) -> None:
        mesh, _ = build_pad_mesh(
            RoundedRectangle(20.0, 18.0, 2.0), 2.0, pitch_mm=(0.7, 0.6), layers=4
        )
        gel = Material(0.147, nu, 1020.0)
        self.exact = surface_operator(mesh, gel, "bbar", "factor")
        self.quick = surface_operator(mesh, gel, "bbar", "fft")
        self.points = np.asarray(mesh.nodes_mm)[mesh.surface]
        square = ((self.points[:, :2] - [1.0, -1.5]) ** 2).sum(axis=1)
        shape = np.sqrt(np.maximum(1 - square / 9.0, 0.0))
        self.mask = square < 3.3**2
        self.force = np.zeros((len(self.points), 3))
        self.force[:, 2] = -2.0 * shape / shape.sum()
        self.force[:, 0] = 0.4 * 2.0 * shape / shape.sum()
        self.motion = self.exact.displacement(self.force)
        rng = np.random.default_rng(12)
        self.noisy = self.motion + rng.normal(size=self.motion.shape) * NOISE_MM

    def error(self, found: np.ndarray) -> float:
        return float(np.linalg.norm(found - self.force) / np.linalg.norm(self.force))


@pytest.fixture(scope="module", params=[0.3223, 0.49])
def press(request: pytest.FixtureRequest) -> Press:
    return Press(request.param)


def test_mask_and_cone_beat_noise(press: Press) -> None:
    raw = press.exact.force(press.noisy)
    found = masked_force(press.quick, press.noisy, press.mask, friction=1.0)
    assert found.converged
    assert press.error(found.force_n) < 0.12
    assert press.error(raw) > 3 * press.error(found.force_n)
    resultant = found.force_n.sum(axis=0) - press.force.sum(axis=0)
    assert np.abs(resultant).max() < 0.05 * 2.0


def test_found_forces_keep_every_constraint(press: Press) -> None:
    found = masked_force(press.quick, press.noisy, press.mask, friction=0.3).force_n
    assert not found[~press.mask].any()
    assert found[:, 2].max() <= 0
    side = np.hypot(found[:, 0], found[:, 1])
    assert (side <= 0.3 * -found[:, 2] + 1e-12).all()


def test_a_warm_start_saves_steps(press: Press) -> None:
    cold = masked_force(press.quick, press.noisy, press.mask)
    warm = masked_force(press.quick, press.noisy, press.mask, start_n=cold.force_n)
    assert warm.steps < cold.steps / 3
    assert press.error(warm.force_n) < 1.1 * press.error(cold.force_n)


def test_without_noise_the_force_comes_back(press: Press) -> None:
    found = masked_force(press.exact, press.motion, press.mask, most_steps=60, tolerance=1e-6)
    assert press.error(found.force_n) < 0.03
    assert found.misfit < 1e-3


def test_smoothing_keeps_the_resultant_exactly(press: Press) -> None:
    raw = press.exact.force(press.noisy)
    soft = smoothing(press.points, 0.7) @ raw
    np.testing.assert_allclose(soft.sum(axis=0), raw.sum(axis=0), atol=1e-10)
    # What smoothing removes is noise: the roughness from node to node falls.
    rough, calm = (np.linalg.norm(f[~press.mask]) for f in (raw, soft))
    assert calm < 0.5 * rough


def test_projection_is_the_nearest_point_of_the_cone() -> None:
    rng = np.random.default_rng(1)
    forces = rng.normal(size=(40, 3))
    for friction in (0.0, 0.4, 2.0):
        found = _projected(forces, np.ones(40, bool), friction)
        for force, ours in zip(forces, found, strict=True):

            def inside(x: np.ndarray, mu: float = friction) -> float:
                return float(-mu * x[2] - np.hypot(x[0], x[1]))

            def push(x: np.ndarray) -> float:
                return float(-x[2])

            best = min(
                float(minimize(
                    lambda x, f=force: ((x - f) ** 2).sum(),
                    start,
                    constraints=[{"type": "ineq", "fun": inside}, {"type": "ineq", "fun": push}],
                    method="SLSQP",
                ).fun)
                for start in ([0.0, 0.0, -0.5], [0.01, 0.01, -1.0])
            )  # fmt: skip
            assert ((ours - force) ** 2).sum() <= best + 1e-5
            assert inside(ours) >= -1e-12
            assert push(ours) >= 0


def test_edge_cases_and_bad_input(press: Press) -> None:
    count = len(press.points)
    nothing = masked_force(press.quick, np.zeros((count, 3)), press.mask)
    assert not nothing.force_n.any()
    assert nothing.misfit == 0.0
    off = masked_force(press.quick, press.noisy, np.zeros(count, bool))
    assert off.misfit == 1.0
    short = masked_force(press.quick, press.noisy, press.mask, most_steps=1)
    assert not short.converged
    lost = press.noisy.copy()
    lost[3, 1] = np.nan
    for motion, options, field, value in (
        (press.noisy[:5], {}, "shape", (5, 3)),
        (press.noisy, {"friction": -1.0}, "friction", -1.0),
        (lost, {}, "node", 3),
    ):
        with pytest.raises(IfemError) as caught:
            masked_force(press.quick, motion, press.mask, **options)
        assert (caught.value.field, caught.value.value) == (field, value)
    with pytest.raises(IfemError) as caught:
        smoothing(press.points, 0.0)
    assert (caught.value.field, caught.value.value) == ("width_mm", 0.0)


def test_step_size_comes_from_the_largest_eigenvalue(press: Press) -> None:
    """The estimate with its margin bounds the exact eigenvalue, whatever the mask."""
    away = np.hypot(press.points[:, 0] - 1.0, press.points[:, 1] + 1.5)
    for radius in (0.6, 1.2, 3.3, 30.0):
        mask = away < radius
        size = 3 * int(mask.sum())

        def twice(values: np.ndarray, mask: np.ndarray = mask) -> np.ndarray:
            spread = np.zeros_like(press.points)
            spread[mask] = values.reshape(-1, 3)
            found = press.quick.displacement(press.quick.displacement(spread))
            return found[mask].ravel()

        exact = eigsh(LinearOperator((size, size), twice), k=1, return_eigenvectors=False)[0]
        estimate = _largest_eigenvalue(press.quick, mask)
        assert estimate <= exact * (1 + 1e-9)
        assert MARGIN * estimate >= exact


def test_products_of_motions_bound_the_cropped_pads_and_are_exact_inside(press: Press) -> None:
    """Against C applied to single forces: far from the rim the same, at the rim never less."""
    gram = press.quick.compliance_products
    inside = np.argsort(np.hypot(*press.points[:, :2].T))[:4]
    rim = np.argsort(press.points[:, 0] + press.points[:, 1])[-4:]
    nodes = np.concatenate([inside, rim])
    columns = []
    for node in nodes:
        for axis in range(3):
            force = np.zeros_like(press.points)
            force[node, axis] = 1.0
            columns.append(press.quick.displacement(force).reshape(-1))
    true = np.array(columns) @ np.array(columns).T
    found = gram.block(nodes)
    scale = np.abs(true).max()
    np.testing.assert_allclose(found, found.T, rtol=0, atol=0)
    np.testing.assert_allclose(found[:12, :12], true[:12, :12], atol=0.01 * scale)
    assert np.linalg.eigvalsh(found - true).min() > -1e-9 * scale


@pytest.mark.parametrize("friction", [0.0, 0.5, np.inf])
@pytest.mark.parametrize("middle", [(0.0, 0.0), (8.5, -7.0)], ids=["centre", "corner"])
def test_a_fit_by_products_is_that_by_the_operator(
    press: Press, middle: tuple[float, float], friction: float
) -> None:
    mask = np.hypot(*(press.points[:, :2] - middle).T) < 2.5
    rng = np.random.default_rng(3)
    push = np.where(mask[:, None], [0.01, 0.004, -0.02], 0.0) * rng.uniform(
        0.5, 1.5, (len(mask), 1)
    )
    motion = press.exact.displacement(push) + rng.normal(size=push.shape) * 0.002
    start = np.zeros_like(motion)
    exact = _Fit(press.quick, motion, mask, friction, 4000, 1e-5).by_operator(start)
    quick = masked_force(
        press.quick, motion, mask, friction=friction, most_steps=4000, tolerance=1e-5
    )
    assert quick.converged
    assert exact.converged
    assert quick.misfit == pytest.approx(exact.misfit, rel=1e-3)
    resultant = exact.force_n.sum(axis=0)
    np.testing.assert_allclose(
        quick.force_n.sum(axis=0), resultant, atol=0.005 * np.linalg.norm(resultant)
    )


def test_the_compiled_projection_is_the_plain_one() -> None:
    rng = np.random.default_rng(4)
    forces = rng.normal(size=(50, 3))
    for friction in (0.0, 0.7, np.inf):
        found = forces.reshape(-1).copy()
        project(found, friction)
        plain = _projected(forces, np.ones(50, bool), friction)
        np.testing.assert_allclose(found.reshape(-1, 3), plain, atol=1e-14)
