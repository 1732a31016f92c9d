"""Conjugate gradients and factors on small matrices, against the textbook's algorithm."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from ifem_export.errors import IfemError
from ifem_export.operators import solver as solvers
from ifem_export.operators.solver import (
    ConjugateGradients,
    ConvergenceError,
    GradientsThenFactor,
    SparseFactor,
)

N = 36


def definite(spread: float, seed: int = 0) -> np.ndarray:
    """A symmetric matrix with eigenvalues from 1 to `spread`, evenly by their logarithms."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(N, N)))
    a = (q * np.geomspace(1.0, spread, N)) @ q.T
    return (a + a.T) / 2


class Counted:
    """A matrix that counts its products, the first `wrong` of which after one have an error."""

    def __init__(self, matrix: np.ndarray, wrong: int = 0) -> None:
        self.matrix, self.shape, self.products, self.wrong = matrix, matrix.shape, 0, wrong

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        self.products += 1
        return self.matrix @ x * (1.0 + 1e-4 * (1 < self.products <= 1 + self.wrong))


class Halved:
    """A preconditioner that acts on fields (2, 6, 3), by a diagonal that changes with the layer."""

    def __init__(self, matrix: np.ndarray) -> None:
        self.weight = 0.5 / np.diag(matrix).reshape(2, 6, 3)

    def __call__(self, field: np.ndarray) -> np.ndarray:
        assert field.shape == (2, 6, 3)
        return self.weight * field


def solver(matrix, most: int = 500) -> ConjugateGradients:
    counted = matrix if isinstance(matrix, Counted) else Counted(matrix)
    return ConjugateGradients(counted, Halved(counted.matrix), 2, most)


def load(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=N)


def textbook(matrix: np.ndarray, b: np.ndarray, steps: int) -> list[np.ndarray]:
    """Iterates of preconditioned conjugate gradients (Saad, algorithm 9.1) from x = M⁻¹ b."""
    inverse = np.diag(0.5 / np.diag(matrix))
    x = inverse @ b
    r = b - matrix @ x
    z = inverse @ r
    p, found = z, [x]
    for _ in range(steps):
        alpha = (r @ z) / (p @ matrix @ p)
        x, rest = x + alpha * p, r - alpha * matrix @ p
        beta = (rest @ inverse @ rest) / (r @ z)
        r, z = rest, inverse @ rest
        p = z + beta * p
        found.append(x)
    return found


@pytest.mark.parametrize("rtol", [0.9, 0.3, 1e-2, 1e-3, 1e-5])
def test_iterates_are_those_of_the_textbook(rtol: float) -> None:
    matrix, b = definite(30.0), load()
    iterates = textbook(matrix, b, 60)
    residuals = [np.linalg.norm(b - matrix @ x) / np.linalg.norm(b) for x in iterates]
    expected = next(k for k, residual in enumerate(residuals) if residual <= rtol)
    found = solver(matrix).solve(b, rtol)
    assert found.iterations == expected
    assert found.x == pytest.approx(iterates[expected], rel=1e-6, abs=1e-8)
    assert found.residual == pytest.approx(residuals[expected], rel=1e-4)


@pytest.mark.parametrize(
    ("rtol", "most_steps", "more"), [(1e-2, 7, 0), (1e-2, 99, 1), (1e-7, 99, 1)]
)
def test_the_true_residual_costs_a_product_only_where_rounding_matters(
    rtol: float, most_steps: int, more: int
) -> None:
    """None after at most seven steps to a loose tolerance."""
    matrix = Counted(definite(4.0 if most_steps == 7 else 400.0))
    found = solver(matrix).solve(load(), rtol)
    assert (found.iterations <= 7) == (most_steps == 7)
    assert matrix.products == 1 + found.iterations + more


def test_a_start_that_suffices_takes_one_product() -> None:
    matrix = Counted(np.diag(np.arange(1.0, N + 1)))
    found = solver(matrix).solve(load(), 0.5001)
    assert (found.iterations, matrix.products) == (0, 1)
    assert found.residual == pytest.approx(0.5)
    exact = ConjugateGradients(matrix, lambda field: 2.0 * Halved(matrix.matrix)(field), 2)
    assert exact.solve(load(), 1e-12).iterations == 0
    assert matrix.products == 2
    none = solver(matrix).solve(np.zeros(N))
    assert (none.residual, none.iterations, none.x.tolist()) == (0.0, 0, [0.0] * N)
    assert matrix.products == 2


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_drifted_residual_is_corrected_by_a_restart(scale: float) -> None:
    true, b = definite(30.0), scale * load()
    found = solver(Counted(true, wrong=12)).solve(b, 1e-10)
    residual = np.linalg.norm(b - true @ found.x) / np.linalg.norm(b)
    assert found.residual == pytest.approx(residual, rel=1e-6)
    assert found.residual <= 1e-10
    alone = solver(Counted(true)).solve(b, 1e-10)
    assert alone.iterations < found.iterations < 2 * alone.iterations
    with pytest.raises(ConvergenceError) as caught:
        solver(Counted(true, wrong=12), most=alone.iterations + 3).solve(b, 1e-10)
    assert caught.value.iterations == alone.iterations + 3


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_cause_is_rounding_where_only_the_updated_residual_is_small(scale: float) -> None:
    """This is so for one limit: before it the tolerance is not met, after it there is a restart."""
    true, causes = definite(30.0), []
    for most in range(20, 36):
        with pytest.raises(ConvergenceError) as caught:
            solver(Counted(true, wrong=12), most).solve(scale * load(), 1e-6)
        assert caught.value.iterations == most
        causes.append(caught.value.cause)
    assert causes.count("rounding") == 1
    assert causes.count("limit") == len(causes) - 1


@pytest.mark.parametrize("most", [1, 2, 5])
def test_without_enough_iterations_the_error_tells_what_was_reached(most: int) -> None:
    matrix = definite(300.0)
    with pytest.raises(ConvergenceError) as caught:
        solver(matrix, most).solve(load(), 1e-6)
    error = caught.value
    assert (error.iterations, error.rtol, error.field, error.value) == (most, 1e-6, "rtol", 1e-6)
    x = textbook(matrix, load(), most)[-1]
    true = np.linalg.norm(load() - matrix @ x) / np.linalg.norm(load())
    assert error.residual == pytest.approx(true, rel=1e-9)
    assert error.cause == "limit"


@pytest.mark.parametrize(
    ("spread", "most", "cause"),
    [
        (1e3, 20, "limit"),
        (1e4, 24, "limit"),
        (1e6, 19, "limit"),
        (1e6, 20, "stagnation"),
        (1e4, 21, "stagnation"),
    ],
)
def test_stagnation_is_half_the_residual_left_after_nineteen_steps(
    spread: float, most: int, cause: str
) -> None:
    matrix = definite(spread)
    residuals = [np.linalg.norm(load() - matrix @ x) for x in textbook(matrix, load(), most)]
    slow = most >= 20 and residuals[-1] > 0.5 * residuals[-20]
    assert cause == ("stagnation" if slow else "limit")
    with pytest.raises(ConvergenceError) as caught:
        solver(matrix, most).solve(load(), 1e-12)
    assert caught.value.cause == cause


def test_the_cause_is_rounding_where_iterations_are_left() -> None:
    with pytest.raises(ConvergenceError) as caught:
        solver(definite(1e3)).solve(load(), 1e-18)
    assert caught.value.cause == "rounding"
    with pytest.raises(ConvergenceError) as caught:
        solver(-definite(10.0)).solve(load(), 1e-6)
    assert caught.value.cause == "rounding"


def test_a_factor_refines_once_and_reports_its_residual() -> None:
    matrix = sparse.csr_array(definite(1e6))
    exact = SparseFactor(matrix)
    assert exact.solve(load(), 1e-6).iterations == 1
    fine = exact.solve(load(), 0.0)
    assert fine.iterations == 2
    for found in (fine, exact.solve(load(), 1e-6)):
        true = np.linalg.norm(load() - matrix @ found.x) / np.linalg.norm(load())
        assert found.residual == pytest.approx(true, abs=1e-15)
    none = exact.solve(np.zeros(N))
    assert (none.residual, none.iterations, none.x.any()) == (0.0, 1, False)


class Rough:
    """A factor whose solutions are `gain` times the true ones."""

    def __init__(self, matrix: np.ndarray, gain: float) -> None:
        self.inverse, self.gain, self.nnz = np.linalg.inv(matrix), gain, N * N

    def solve(self, b: np.ndarray) -> np.ndarray:
        return self.gain * self.inverse @ b


@pytest.mark.parametrize(
    ("gain", "rtol", "steps"), [(1 + 1e-3, 1e-2, 1), (1 - 1e-3, 1e-5, 2), (1 + 1e-6, 1e-9, 2)]
)
def test_refinement_squares_the_error_of_a_factor(gain: float, rtol: float, steps: int) -> None:
    matrix = definite(30.0)
    rough = SparseFactor(sparse.csr_array(matrix))
    rough.__dict__["factor"] = Rough(matrix, gain)
    found = rough.solve(load(), rtol)
    assert found.iterations == steps
    assert found.residual == pytest.approx(abs(gain - 1) ** steps, rel=1e-2, abs=1e-14)
    assert found.x == pytest.approx(np.linalg.solve(matrix, load()), rel=2 * rtol)


def test_a_rough_factor_is_refused() -> None:
    matrix = definite(30.0)
    rough = SparseFactor(sparse.csr_array(matrix))
    rough.__dict__["factor"] = Rough(matrix, 1.01)
    with pytest.raises(ConvergenceError) as caught:
        rough.solve(load(), 1e-9)
    assert (caught.value.cause, caught.value.rtol) == ("rounding", 1e-9)
    assert caught.value.residual == pytest.approx(1e-4, rel=1e-6)
    # Below the accuracy that every factor must reach, the tolerance does not matter.
    rough.__dict__["factor"] = Rough(matrix, 1 + 0.9e-4)
    assert rough.solve(load(), 0.0).residual == pytest.approx(0.81e-8, rel=1e-3)


def test_the_factor_replaces_gradients_for_good_after_a_failure() -> None:
    matrix = definite(30.0)
    both = GradientsThenFactor(
        ConjugateGradients(sparse.csr_array(matrix), Halved(matrix), 2, most_iterations=4)
    )
    easy = both.solve(load(), 0.6)
    assert easy.iterations == 2
    assert "factor" not in both.__dict__
    assert both.solve(load(), 1e-9).residual <= 1e-9
    assert "factor" in both.__dict__
    assert both.solve(load(), 0.6).iterations == 1


@pytest.mark.parametrize("most", [N - 1, N])
def test_a_matrix_too_large_to_factor_is_refused(
    monkeypatch: pytest.MonkeyPatch, most: int
) -> None:
    monkeypatch.setattr(solvers, "MOST_FACTORED", most)
    matrix = definite(30.0)
    both = GradientsThenFactor(
        ConjugateGradients(sparse.csr_array(matrix), Halved(matrix), 2, most_iterations=4)
    )
    if most == N:
        assert both.solve(load(), 1e-9).residual <= 1e-9
        return
    with pytest.raises(ConvergenceError) as caught:
        both.solve(load(), 1e-9)
    assert caught.value.iterations == 4


@pytest.mark.parametrize(("b", "value"), [(np.ones(N + 1), N + 1), (np.full(N, np.nan), None)])
def test_a_load_that_does_not_fit_is_refused(b: np.ndarray, value: int | None) -> None:
    for one in (solver(definite(3.0)), SparseFactor(sparse.csr_array(definite(3.0)))):
        with pytest.raises(IfemError) as caught:
            one.solve(b)
        assert (caught.value.field, caught.value.value) == ("b", value)
