"""Solvers at the ends of thickness, cell aspect and Poisson's ratio, and the choice of factor."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from ifem_shapes import Polygon, disc
from sampled import quick
from scipy import sparse

from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError
from ifem_export.mesh.outline import Outline, RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.layered_operator import LEAST_PADDING, even_fast_length, padding_columns
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import ConvergenceError, factored, inner_solver, pad_solver

OUTLINES: dict[str, Outline] = {
    "rectangle": RoundedRectangle(16.0, 14.0, 3.0),
    "disc": disc(8.0),
    "polygon": Polygon([(-8, -8), (8, -8), (8, 2), (0, 2), (0, 8), (-8, 8)]),
    "long": RoundedRectangle(30.0, 5.0, 1.0),
}


def system(mesh: PadMesh, nu: float) -> PadSystem:
    gel = Material(0.147, nu, 1020.0)
    return PadSystem(mesh, hex8_stiffness(mesh.cell_size_mm, gel, "bbar"))


def block(aspect: float, cells: int = 12, layers: int = 4) -> PadMesh:
    h = 0.5 * aspect
    occupancy = np.ones((cells, cells, layers), dtype=bool)
    return PadMesh.from_occupancy(occupancy, (0.5, 0.4, h), (0.0, 0.0, -layers * h))


@pytest.mark.parametrize("name", OUTLINES)
@pytest.mark.parametrize("thickness", quick([0.05, 0.2, 2.0, 20.0], (0.05, 20.0).__contains__))
def test_iterations_at_near_incompressibility_at_most_double(name: str, thickness: float) -> None:
    """Thin pads too: an even transform and some padding keep theirs from quintupling."""
    mesh, _ = build_pad_mesh(OUTLINES[name], thickness, pitch_mm=(0.8, 0.7), layers=4)
    rng = np.random.default_rng(1)
    for make in (pad_solver, inner_solver):
        counts = []
        for nu in (0.3, 0.4999):
            pad = system(mesh, nu)
            n = (pad.stiffness if make is pad_solver else pad.inner).shape[0]
            counts.append(make(pad, "pcg").solve(rng.normal(size=n), 1e-8).iterations)
        # Where 0.3 needs fewer than 20 there is little left to double.
        assert counts[1] <= max(2 * counts[0], 40), (make.__name__, counts)


@pytest.mark.parametrize("aspect", [0.02, 0.1, 1.0, 10.0, 50.0])
@pytest.mark.parametrize("nu", [0.3, 0.49, 0.4999])
def test_any_cell_aspect_is_solved_or_says_what_rounding_allows(aspect: float, nu: float) -> None:
    pad = system(block(aspect), nu)
    b = np.random.default_rng(2).normal(size=pad.stiffness.shape[0])
    b[: len(b) * 3 // 4] = 0.0
    if (aspect, nu) == (50.0, 0.4999):
        with pytest.raises(ConvergenceError) as caught:
            pad_solver(pad, "pcg").solve(b, 1e-9)
        assert 1e-9 < caught.value.residual < 1e-6
        assert pad_solver(pad, "pcg").solve(b, 1e-6).residual <= 1e-6
        # A factor takes over. Its residual is that of rounding the matrix; its solution is right.
        found = pad_solver(pad, "iterative").solve(b, 1e-9)
        assert 1e-9 < found.residual < 1e-6
        again = pad_solver(pad, "direct").solve(pad.stiffness @ found.x).x
        assert np.abs(again - found.x).max() < 1e-5 * np.abs(found.x).max()
        return
    found = pad_solver(pad, "pcg").solve(b, 1e-8)
    assert found.residual <= 1e-8
    truth = np.linalg.norm(b - pad.stiffness @ found.x) / np.linalg.norm(b)
    assert found.residual == pytest.approx(truth, rel=1e-6)
    assert found.iterations < 120


def test_a_drifted_residual_is_never_reported() -> None:
    """The updated residual meets any tolerance, the true one does not."""
    pad = system(block(50.0), 0.49)
    b = np.random.default_rng(3).normal(size=pad.stiffness.shape[0])
    assert pad_solver(pad, "pcg").solve(b, 1e-7).residual <= 1e-7
    with pytest.raises(ConvergenceError) as caught:
        pad_solver(pad, "pcg").solve(b, 1e-13)
    assert 1e-13 < caught.value.residual < 1e-7


@pytest.mark.parametrize("least", [1, 2, 21, 27, 43, 49, 75, 81, 125, 135])
def test_transforms_have_even_fast_lengths(least: int) -> None:
    length = even_fast_length(least)
    assert length >= least
    assert length % 2 == 0
    for prime in (2, 3, 5):
        while length % prime == 0:
            length //= prime
    assert length == 1


def test_padding_has_a_floor_and_a_cap() -> None:
    assert padding_columns((0.5, 0.5, 0.01), 4, (20, 20)) == (LEAST_PADDING, LEAST_PADDING)
    assert padding_columns((0.5, 1.0, 2.0), 4, (20, 20)) == (14, 28)
    assert padding_columns((0.5, 0.5, 25.0), 4, (13, 13)) == (26, 26)


def test_a_factor_solves_several_loads() -> None:
    pad = system(block(1.0, cells=6), 0.49)
    dense = pad.stiffness.toarray()
    b = np.random.default_rng(5).normal(size=(len(dense), 2))
    found = factored(pad.stiffness).solve(b)
    expected = np.linalg.solve(dense, b)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
    assert pad_solver(pad, "direct").solve(b[:, 0]).residual < 1e-10


def test_a_matrix_without_a_factor_is_refused() -> None:
    with pytest.raises(IfemError) as caught:
        factored(sparse.csr_array(np.diag([1.0, 0.0, 2.0])))
    assert caught.value.field == "matrix"
    with pytest.raises(IfemError) as caught:
        pad_solver(system(block(1.0, cells=2), 0.3), "magic")  # type: ignore[arg-type]
    assert (caught.value.field, caught.value.value) == ("method", "magic")


THREADS = """
import hashlib, numpy as np
from ifem_export.elements.material import Material
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh
from ifem_export.operators.surface_operator import surface_operator
mesh, _ = build_pad_mesh(RoundedRectangle(20.0, 20.0, 10.0), 2.0, pitch_mm=0.6, layers=4)
u = np.random.default_rng(0).normal(size=(len(mesh.surface), 3))
gel = Material(0.147, 0.45, 1000.0)
for rung in ("paper", "truncated", "fft", "pcg"):
    f = surface_operator(mesh, gel, "bbar", rung, rtol=1e-9).force(u)
    print(rung, ",".join(f"{x:.17g}" for x in f[::97].ravel()))
"""


@pytest.mark.slow
@pytest.mark.skipif(find_spec("numba") is None, reason="numba is not installed")
def test_threads_change_nothing_beyond_the_tolerance() -> None:
    """BLAS may add in another order: the answers agree to rounding, pcg to its tolerance."""
    answers = []
    for threads in ("1", "2"):
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
        env = {**os.environ, **dict.fromkeys(names, threads)}
        run = subprocess.run(
            [sys.executable, "-c", THREADS], env=env, capture_output=True, text=True, check=True
        )
        answers.append([np.fromstring(r.split()[1], sep=",") for r in run.stdout.splitlines()])
    for one, two in zip(*answers, strict=True):
        assert np.linalg.norm(one - two) <= 1e-8 * np.linalg.norm(one)


@pytest.mark.parametrize("nu", [0.3223, 0.49, 0.4999])
def test_the_residual_of_a_loose_solve_is_the_true_one(nu: float) -> None:
    """It is followed there, not computed afresh."""
    mesh, _ = build_pad_mesh(RoundedRectangle(16.0, 14.0, 1.0), 2.0, pitch_mm=0.7, layers=4)
    pad = system(mesh, nu)
    load = np.random.default_rng(3).normal(size=pad.inner.shape[0])
    for rtol in (1e-2, 1e-4, 1e-5):
        found = inner_solver(pad, "pcg").solve(load, rtol)
        true = np.linalg.norm(load - pad.inner @ found.x) / np.linalg.norm(load)
        assert found.residual == pytest.approx(true, rel=1e-6)
        assert true <= rtol * (1 + 1e-6)
