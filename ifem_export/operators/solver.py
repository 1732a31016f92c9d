"""Solvers of the pad's equations behind one interface; the true residual is always reported."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol, cast, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ifem_export.errors import IfemError
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.sparse_factor import Backend, Factor, factored
from ifem_export.operators.weighted_guess import Guess

Array = NDArray[np.float64]
Method = Literal["auto", "pcg", "direct", "superlu", "cholmod", "pardiso"]
METHODS: tuple[str, ...] = get_args(Method)
MOST_ITERATIONS = 500
DIRECT_BELOW = 2000
"""Unknowns under which a factor is quicker than the first transform."""
DIRECT_RESIDUAL = 1e-8
MOST_FACTORED = 60_000
"""Unknowns up to which a factor stands in for conjugate gradients that fail: some 2 GB."""
LOOSE, FEW_STEPS = 1e-5, 8
"""Tolerance and steps for which rounding is no matter: the residual followed is as good as new."""
STALLED = 0.1
"""A restart that gains less than this factor has met the rounding floor."""


class ConvergenceError(IfemError):
    """No solution within the tolerance; the message says how far it got and what to try."""


@dataclass(frozen=True, eq=False)
class Solution:
    """`x` of A x = b; `residual` is |b - A x| / |b|, computed afresh from x.

    After a few steps to a loose tolerance it is the one followed, which differs by rounding.
    """

    x: Array
    residual: float
    iterations: int
    seconds: float


class Solver(Protocol):
    """Solves A x = b for one matrix."""

    def solve(self, b: ArrayLike, rtol: float = 1e-8) -> Solution:
        """Raise IfemError for a bad b, ConvergenceError where |b - A x| <= rtol |b| fails."""


@dataclass(frozen=True, eq=False)
class ConjugateGradients:
    """Conjugate gradients preconditioned by the infinite layered pad."""

    matrix: sparse.csr_array
    guess: Guess
    layers: int
    most_iterations: int = MOST_ITERATIONS

    def solve(self, b: ArrayLike, rtol: float = 1e-8) -> Solution:
        """Solve to a relative residual; starts from the preconditioner's answer."""
        started = time.perf_counter()
        right = _checked(b, self.matrix.shape[0])
        size = float(np.linalg.norm(right))
        if size == 0.0:
            return Solution(np.zeros_like(right), 0.0, 0, time.perf_counter() - started)
        x, trail = _iterate(self.matrix, right, self._guess, rtol * size, self.most_iterations)
        followed = len(trail) == 1 or (rtol >= LOOSE and len(trail) <= FEW_STEPS)
        residual = (trail[-1] if followed else self._residual(right, x)) / size
        before = np.inf
        # The updated residual drifts from the true one: go on from the true one where it did.
        while rtol < residual < STALLED * before and len(trail) <= self.most_iterations:
            left = self.most_iterations + 1 - len(trail)
            rest = right - self.matrix @ x
            more, steps = _iterate(self.matrix, rest, self._guess, rtol * size, left)
            x, trail = x + more, trail + steps
            residual, before = self._residual(right, x) / size, residual
        if not residual <= rtol:
            shown = [t / size for t in trail]
            raise ConvergenceError(_diagnosis(residual, rtol, shown, self.most_iterations))
        return Solution(x, residual, len(trail) - 1, time.perf_counter() - started)

    def _residual(self, right: Array, x: Array) -> float:
        return float(np.linalg.norm(right - self.matrix @ x))

    def _guess(self, r: Array) -> Array:
        return self.guess(r.reshape(self.layers, -1, 3)).reshape(-1)


@dataclass(frozen=True, eq=False)
class SparseFactor:
    """Sparse factor, made on the first use and kept."""

    matrix: sparse.csr_array
    backend: Backend = "auto"

    @cached_property
    def factor(self) -> Factor:
        """The factor; raises IfemError for a matrix that has none."""
        return factored(self.matrix, self.backend)

    def solve(self, b: ArrayLike, rtol: float = 1e-8) -> Solution:
        """Back-substitute, once more on the residual where that is not enough."""
        started = time.perf_counter()
        right = _checked(b, self.matrix.shape[0])
        size = float(np.linalg.norm(right))
        x = np.asarray(self.factor.solve(right))
        residual = 0.0 if size == 0.0 else float(np.linalg.norm(right - self.matrix @ x)) / size
        steps = 1
        if residual > rtol:
            x = x + self.factor.solve(right - self.matrix @ x)
            residual, steps = float(np.linalg.norm(right - self.matrix @ x)) / size, 2
        if not residual <= max(rtol, DIRECT_RESIDUAL):
            raise ConvergenceError(_diagnosis(residual, rtol, [residual], 1))
        return Solution(x, residual, steps, time.perf_counter() - started)


@dataclass(frozen=True, eq=False)
class WithFactor:
    """Conjugate gradients, and once they fail a factor for good.

    Cut cells of a nearly incompressible gel are what the infinite pad does not foresee.
    """

    first: ConjugateGradients

    def solve(self, b: ArrayLike, rtol: float = 1e-8) -> Solution:
        """Raise as `Solver`; ConvergenceError where the matrix is too large to factor."""
        if "factor" in self.__dict__:
            return self.factor.solve(b, rtol)
        try:
            return self.first.solve(b, rtol)
        except ConvergenceError:
            if self.first.matrix.shape[0] > MOST_FACTORED:
                raise
            return self.factor.solve(b, rtol)

    @cached_property
    def factor(self) -> SparseFactor:
        """The factor, made when it is needed."""
        return SparseFactor(self.first.matrix)


def pad_solver(system: PadSystem, method: Method = "auto") -> Solver:
    """Solver of the free unknowns, K_ff u = f; IfemError for an unknown or missing method."""
    direct = _direct(system.stiffness, method)
    return direct or ConjugateGradients(
        system.stiffness, system.compliance_guess, system.guess_layers[0]
    )


def inner_solver(system: PadSystem, method: Method = "auto") -> Solver:
    """Solver of the inner unknowns with the surface held, K_ii u = f. At least two layers."""
    if system.inner.shape[0] == 0:
        raise IfemError("a pad of one layer has no inner nodes: nothing is left to solve")
    direct = _direct(system.inner, method)
    if direct is not None:
        return direct
    steps = ConjugateGradients(system.inner, system.inner_guess, system.guess_layers[1])
    return WithFactor(steps) if method == "auto" and system.is_cut else steps


def _direct(matrix: sparse.csr_array, method: Method) -> SparseFactor | None:
    """The factor that `method` stands for; None for conjugate gradients."""
    if method not in METHODS:
        raise IfemError(f"solver method {method!r}: must be one of {', '.join(METHODS)}")
    if method == "pcg" or (method == "auto" and matrix.shape[0] >= DIRECT_BELOW):
        return None
    backend = "auto" if method in ("auto", "direct") else method
    return SparseFactor(matrix, cast(Backend, backend))


def _iterate(
    matrix: sparse.csr_array,
    b: Array,
    guess: Callable[[Array], Array],
    tolerance: float,
    most: int,
) -> tuple[Array, list[float]]:
    """Preconditioned conjugate gradients; x and the residual norms, the first at x = M⁻¹ b."""
    x = guess(b)
    r = b - matrix @ x
    trail = [float(np.linalg.norm(r))]
    p, rho = np.zeros_like(b), 1.0
    while trail[-1] > tolerance and len(trail) <= most and np.isfinite(trail[-1]):
        z = guess(r)
        rho, last = float(r @ z), rho
        p = z if len(trail) == 1 else z + rho / last * p
        q = matrix @ p
        curvature = float(p @ q)
        if not (curvature > 0 and rho > 0):
            break
        step = rho / curvature
        x = x + step * p
        r = r - step * q
        trail.append(float(np.linalg.norm(r)))
    return x, trail


def _checked(b: ArrayLike, n: int) -> Array:
    right = np.asarray(b, dtype=float).reshape(-1)
    if right.shape != (n,):
        raise IfemError(f"the right-hand side has {right.size} values: must have {n}")
    if not np.isfinite(right).all():
        raise IfemError("the right-hand side holds a value that is not finite")
    return right


def _diagnosis(residual: float, rtol: float, trail: list[float], most: int) -> str:
    """What went wrong and what to do; `trail` holds the relative residuals."""
    tail = ", ".join(f"{t:.2g}" for t in trail[-4:])
    if len(trail) > most > 1 and trail[-1] > rtol:
        slow = len(trail) > 20 and trail[-1] > 0.5 * trail[-20]
        why = (
            "it hardly falls any more, the matrix is ill-conditioned: use method 'direct', cells "
            "of an aspect nearer 1 or a Poisson's ratio further from 0.5"
            if slow
            else "allow more iterations or a looser tolerance"
        )
    else:
        why = (
            "rounding allows no less for this matrix and load: ask for a tolerance of "
            f"{2 * residual:.0e} or more, or take cells of an aspect nearer 1 or a Poisson's "
            "ratio further from 0.5"
        )
    return (
        f"no solution to {rtol:.1g} after {len(trail) - 1} iterations: residual {residual:.2g} "
        f"(last: {tail}); {why}"
    )
