"""Solvers of the pad's equations behind one interface. They always report the true residual."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from ifem_export.errors import IfemError
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.preconditioner import Preconditioner
from ifem_export.operators.symmetric_matrix import Matrix, matrix_bytes

Array = NDArray[np.float64]
Method = Literal["auto", "iterative", "pcg", "direct"]
"""`iterative` is conjugate gradients, replaced by a factor where they fail; `pcg` is without that
replacement, `direct` the factor alone, and `auto` a factor for few unknowns, else `iterative`."""
METHODS: tuple[str, ...] = get_args(Method)
Cause = Literal["rounding", "stagnation", "limit"]
MOST_ITERATIONS = 500
DIRECT_BELOW = 2000
"""Number of unknowns below which a factor is faster than the first transform."""
DIRECT_RESIDUAL = 1e-8
ROUNDING = 4.0 * float(np.finfo(float).eps)
"""Relative backward error that is rounding."""
MOST_FACTORED = 60_000
"""Number of unknowns up to which a factor replaces failing conjugate gradients: about 2 GB."""
LOOSE, FEW_STEPS = 1e-5, 8
"""At this tolerance and number of steps, rounding in the updated residual does not matter."""
STALLED = 0.1
"""A restart that reduces the residual by less than this factor has met the rounding floor."""


class ConvergenceError(IfemError):
    """No solution within the tolerance.

    Attributes:
        residual: Relative residual reached.
        rtol: Relative residual requested.
        iterations: Iterations taken.
        cause: "rounding" (no smaller residual is possible), "stagnation" (the residual hardly
            decreases any more) or "limit" (more iterations were not allowed).
    """

    def __init__(
        self,
        message: str,
        residual: float = np.nan,
        rtol: float = np.nan,
        iterations: int = 0,
        cause: Cause = "limit",
    ) -> None:
        super().__init__(message, field="rtol", value=rtol)
        self.residual = residual
        self.rtol = rtol
        self.iterations = iterations
        self.cause = cause


@dataclass(frozen=True, eq=False)
class Solution:
    """Solution of A x = b.

    Attributes:
        x: (n,).
        residual: |b - A x| / |b|, computed from x. After few steps to a loose tolerance it is the
            residual that the iteration updates, which differs by rounding only.
        iterations: Iterations or back-substitutions taken.
    """

    x: Array
    residual: float
    iterations: int


def factored(matrix: sparse.csr_array) -> SuperLU:
    """Factor a symmetric positive definite matrix by SuperLU.

    Raises:
        IfemError: The matrix is singular, or there is not enough memory.
    """
    try:
        factor = splu(
            sparse.csc_array(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except MemoryError as error:
        raise IfemError(
            f"no memory to factor {matrix.shape[0]} unknowns: take the operator 'pcg', which needs "
            "none",
            field="matrix",
        ) from error
    except RuntimeError as error:
        raise IfemError(
            f"the stiffness matrix cannot be factored ({error})", field="matrix"
        ) from error
    return factor


class Solver(Protocol):
    """Solves A x = b for one matrix."""

    @property
    def n_bytes(self) -> int:
        """Bytes that an iteration or a back-substitution reads."""

    def solve(self, b: ArrayLike, rtol: float = 1e-8) -> Solution:
        """Solve to |b - A x| <= rtol |b|.

        Raises IfemError for an unusable b and ConvergenceError if the tolerance is not reached.
        """


@dataclass(frozen=True, eq=False)
class ConjugateGradients:
    """Conjugate gradients, preconditioned by the infinite pad."""

    matrix: Matrix
    preconditioner: Preconditioner
    layers: int
    most_iterations: int = MOST_ITERATIONS

    @property
    def n_bytes(self) -> int:
        """Bytes that an iteration reads."""
        return int(matrix_bytes(self.matrix) + self.preconditioner.blocks.nbytes)

    def solve(self, b: ArrayLike, rtol: float = 1e-8) -> Solution:
        """Solve to a relative residual, starting from the preconditioner's result.

        Raises ConvergenceError where the residual stays above `rtol`.
        """
        right = _checked(b, self.matrix.shape[0])
        size = float(np.linalg.norm(right))
        if size == 0.0:
            return Solution(np.zeros_like(right), 0.0, 0)
        x, norms = _iterate(
            self.matrix, right, self._precondition, rtol * size, self.most_iterations
        )
        is_exact = len(norms) == 1 or (rtol >= LOOSE and len(norms) <= FEW_STEPS)
        residual = (norms[-1] if is_exact else self._residual(right, x)) / size
        before = np.inf
        # The updated residual drifts from the true one: restart from the true one if it did.
        while rtol < residual < STALLED * before and len(norms) <= self.most_iterations:
            # The first residual after a restart counts as an iteration, because it costs as much.
            left = self.most_iterations - len(norms)
            rest = right - self.matrix @ x
            more, steps = _iterate(self.matrix, rest, self._precondition, rtol * size, left)
            x, norms = x + more, norms + steps
            residual, before = self._residual(right, x) / size, residual
        if not residual <= rtol:
            relative = [norm / size for norm in norms]
            raise _no_convergence(residual, rtol, relative, self.most_iterations)
        return Solution(x, residual, len(norms) - 1)

    def _residual(self, right: Array, x: Array) -> float:
        return float(np.linalg.norm(right - self.matrix @ x))

    def _precondition(self, r: Array) -> Array:
        return self.preconditioner(r.reshape(self.layers, -1, 3)).ravel()


@dataclass(frozen=True, eq=False)
class SparseFactor:
    """Sparse factor, computed at the first use and kept."""

    matrix: sparse.csr_array

    @property
    def n_bytes(self) -> int:
        """Bytes of the factor, and of the matrix, with which the residual is computed."""
        return int(matrix_bytes(self.matrix) + 12 * self.factor.nnz)

    @cached_property
    def factor(self) -> SuperLU:
        """The factor. Raises IfemError for a matrix that cannot be factored."""
        return factored(self.matrix)

    @cached_property
    def _norm(self) -> float:
        """Largest sum of magnitudes of a row."""
        return float(abs(self.matrix).sum(axis=1).max())

    def solve(self, b: ArrayLike, rtol: float = 1e-8) -> Solution:
        """Back-substitute, and once more on the residual if that does not suffice.

        A residual above the tolerance is accepted if it is that of rounding the matrix: the
        solution is then exact for a matrix with the same digits (Rigal and Gaches 1967).
        Raises ConvergenceError for a larger one.
        """
        right = _checked(b, self.matrix.shape[0])
        size = float(np.linalg.norm(right))
        x = np.asarray(self.factor.solve(right))
        residual = 0.0 if size == 0.0 else float(np.linalg.norm(right - self.matrix @ x)) / size
        steps = 1
        if residual > rtol:
            x = x + self.factor.solve(right - self.matrix @ x)
            residual, steps = float(np.linalg.norm(right - self.matrix @ x)) / size, 2
        if not (residual <= max(rtol, DIRECT_RESIDUAL) or self._is_rounding(x, residual, size)):
            raise _no_convergence(residual, rtol, [residual], 1)
        return Solution(x, residual, steps)

    def _is_rounding(self, x: Array, residual: float, size: float) -> bool:
        return residual * size <= ROUNDING * (self._norm * float(np.linalg.norm(x)) + size)


@dataclass(frozen=True, eq=False)
class GradientsThenFactor:
    """Conjugate gradients, replaced by a factor from the first failure on.

    Rounding keeps the residual of a nearly incompressible gel large, and the infinite pad is a
    poor preconditioner for its cut cells.
    """

    first: ConjugateGradients

    @property
    def n_bytes(self) -> int:
        """Bytes that an iteration of conjugate gradients reads."""
        return self.first.n_bytes

    def solve(self, b: ArrayLike, rtol: float = 1e-8) -> Solution:
        """See `Solver`; raises ConvergenceError if the matrix is too large to factor."""
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
        """The factor, computed when it is needed."""
        return SparseFactor(self.first.matrix.tocsr())


def pad_solver(system: PadSystem, method: Method = "auto") -> Solver:
    """Solver of the free unknowns, K_ff u = f. Raises IfemError for an unknown method."""
    direct = _direct(system.stiffness, method)
    if direct is not None:
        return direct
    layers = system.preconditioner_layers[0]
    gradients = ConjugateGradients(system.stiffness, system.preconditioner, layers)
    return gradients if method == "pcg" else GradientsThenFactor(gradients)


def inner_solver(system: PadSystem, method: Method = "auto") -> Solver:
    """Solver of the inner unknowns with the surface fixed, K_ii u = f.

    Raises IfemError for an unknown method and for a pad of one layer.
    """
    if system.inner.shape[0] == 0:
        raise IfemError(
            "a pad of one layer has no inner nodes to solve for", field="layers", value=1
        )
    direct = _direct(system.inner, method)
    if direct is not None:
        return direct
    layers = system.preconditioner_layers[1]
    gradients = ConjugateGradients(system.inner, system.inner_preconditioner, layers)
    return gradients if method == "pcg" else GradientsThenFactor(gradients)


def _direct(matrix: sparse.csr_array, method: Method) -> SparseFactor | None:
    """The factor that `method` means; None for conjugate gradients."""
    if method not in METHODS:
        raise IfemError(
            f"solver method {method!r}: must be one of {', '.join(METHODS)}",
            field="method",
            value=method,
        )
    few = method == "auto" and matrix.shape[0] < DIRECT_BELOW
    return SparseFactor(matrix) if few or method == "direct" else None


def _iterate(
    matrix: Matrix,
    b: Array,
    precondition: Callable[[Array], Array],
    tolerance: float,
    most: int,
) -> tuple[Array, list[float]]:
    """Preconditioned conjugate gradients: x and the residual norms, the first at x = M⁻¹ b."""
    x = precondition(b)
    r = b - matrix @ x
    norms = [float(np.linalg.norm(r))]
    p, rho = np.zeros_like(b), 1.0
    while norms[-1] > tolerance and len(norms) <= most and np.isfinite(norms[-1]):
        z = precondition(r)
        rho, last = float(r @ z), rho
        p = z + rho / last * p
        q = matrix @ p
        curvature = float(p @ q)
        if not (curvature > 0 and rho > 0):
            break
        step = rho / curvature
        x = x + step * p
        r = r - step * q
        norms.append(float(np.linalg.norm(r)))
    return x, norms


def _checked(b: ArrayLike, n: int) -> Array:
    right = np.asarray(b, dtype=float).ravel()
    if right.shape != (n,):
        raise IfemError(
            f"the right-hand side has {right.size} values: must have {n}",
            field="b",
            value=right.size,
        )
    if not np.isfinite(right).all():
        raise IfemError("the right-hand side holds a value that is not finite", field="b")
    return right


def _no_convergence(
    residual: float, rtol: float, norms: list[float], most: int
) -> ConvergenceError:
    """The error with its cause and remedy; `norms` holds the relative residuals."""
    iterations = len(norms) - 1
    if iterations < most or norms[-1] <= rtol:
        cause: Cause = "rounding"
        why = (
            "rounding allows no smaller residual for this matrix and load: request a tolerance "
            "well above that, or use cells of an aspect nearer 1 or a Poisson's ratio further "
            "from 0.5"
        )
    elif iterations >= 20 and norms[-1] > 0.5 * norms[-20]:
        cause = "stagnation"
        why = (
            "it hardly decreases any more, the matrix is ill-conditioned: take the operator "
            "'factor', cells of an aspect nearer 1 or a Poisson's ratio further from 0.5"
        )
    else:
        cause = "limit"
        why = "allow more iterations or a larger tolerance"
    message = f"no solution to {rtol:.1g} after {iterations} iterations: residual {residual:.2g}"
    return ConvergenceError(f"{message}; {why}", residual, rtol, iterations, cause)
