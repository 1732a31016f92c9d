"""Tangential tractions with a part in common: the prior, and what it does to sheared contacts."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from pressed_samples import fine_pad, lit_bundle, surface_splines
from scipy.optimize import minimize
from sensor_samples import sensor_bundle
from sigma_cases import picture_of
from sigma_gate import nothing_given

from gelslim_force.joint.common_shear import TangentialPrior
from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.normal_equations import NormalEquations

Array = NDArray[np.float64]
ROUGH, SIZE, RATIO = 0.02, 0.005, 0.8


@cache
def lattice() -> NodeLattice:
    mesh = sensor_bundle().mesh
    return NodeLattice.of(np.asarray(mesh.surface_mm), np.asarray(mesh.cell_size_mm[:2]))


def two_contacts() -> NDArray[np.intp]:
    """Nodes of two contacts, with nodes between them."""
    place = lattice().place
    return np.flatnonzero((np.abs(place - [12, 12]) <= [5, 2]).all(axis=1))


def deviation(force: Array, neighbours: Array, area: Array) -> float:
    """What the prior of the deviations gives for forces (p,) along one axis."""
    traction = force / area
    apart = (traction[:, None] - traction) ** 2 * neighbours
    return float(apart.sum() / 2 / ROUGH**2 + (traction**2).sum() / SIZE**2)


@pytest.mark.parametrize("seed", [0, 1])
def test_the_common_ratio_is_the_best_one_of_each_contact(seed: int) -> None:
    """The least of the prior over the ratio, for each contact and axis by itself."""
    rng, nodes = np.random.default_rng(seed), two_contacts()
    count, beside = len(nodes), lattice().adjacent(nodes)
    place = lattice().place[nodes]
    push = np.where(place[:, 0] == 12, 0.0, rng.uniform(0.001, 0.01, count))
    area, force = rng.uniform(0.3, 0.6, count), rng.normal(0, 0.003, (count, 3))
    force[:, 2] = -push
    prior = TangentialPrior(3 * np.arange(count) + np.array([[0], [1]]), beside, area, ROUGH, SIZE)
    start = force.ravel()
    plain = NormalEquations.of(3 * count).with_prior(start, beside, area, ROUGH, 1.0, SIZE)
    freed = prior.with_common_shear(plain, start, push, RATIO, (nodes, lattice()))
    taken = start @ (plain.hessian - freed.hessian) @ start
    expected = 0.0
    sides = [push * (place[:, 0] < 12), push * (place[:, 0] > 12)]
    for axis in (0, 1):

        def least(ratios: Array, axis: int = axis) -> float:
            left = force[:, axis] - ratios[0] * sides[0] - ratios[1] * sides[1]
            return deviation(left, beside, area) + float((ratios**2).sum()) / RATIO**2

        best = minimize(least, np.zeros(2), method="BFGS", options={"gtol": 1e-6})
        expected += deviation(force[:, axis], beside, area) - best.fun
    assert taken == pytest.approx(expected, rel=1e-5)
    np.testing.assert_allclose(plain.slope - freed.slope, (plain.hessian - freed.hessian) @ start)
    assert np.linalg.eigvalsh(freed.hessian).min() > 0


def test_without_a_ratio_or_a_contact_nothing_is_in_common() -> None:
    nodes = two_contacts()
    count, beside = len(nodes), lattice().adjacent(nodes)
    numbers = 3 * np.arange(count) + np.array([[0], [1]])
    prior = TangentialPrior(numbers, beside, np.ones(count), ROUGH, SIZE)
    plain, at = NormalEquations.of(3 * count), (nodes, lattice())
    assert prior.with_common_shear(plain, np.zeros(3 * count), np.zeros(count), 1.0, at) is plain
    assert prior.with_common_shear(plain, np.zeros(3 * count), np.ones(count), 0.0, at) is plain


@pytest.mark.slow
def test_a_shear_to_either_side_leaves_the_normal_force() -> None:
    """A round press on a finer pad, seen at a slant along x. It read as 2.4 % less with a shear of
    0.4 to the one side, and as 7.2 % more to the other."""
    pad = fine_pad(1.0, lit_bundle().material.poissons_ratio)
    x, y = (pad.points_mm[:, :2] - [0.3, -3.3]).T
    pressure = 0.02 * np.sqrt(np.maximum(1 - (x * x + y * y) / 2.2**2, 0)) * pad.cell_mm2
    off = []
    for shear in (0.4, -0.4):
        force = np.column_stack([shear * pressure, 0 * pressure, -pressure])
        splines = surface_splines(pad.points_mm, pad.displacement(force))
        drawn = picture_of(lambda at, s=splines: np.column_stack([k.ev(*at.T) for k in s]), 1.0)
        found = []
        for seed in range(4):
            noise = np.random.default_rng(seed).normal(0, 1.5, drawn.shape)
            pipeline = nothing_given()
            pipeline.reset()
            result = pipeline.process(np.clip(np.rint(drawn + noise), 0, 255).astype(np.uint8))
            assert result.wrench is not None
            found.append(result.wrench.force_n[2])
        off.append(np.mean(found) / force[:, 2].sum() - 1)
    assert np.abs(off).max() < 0.04
    assert abs(off[0] - off[1]) < 0.02
