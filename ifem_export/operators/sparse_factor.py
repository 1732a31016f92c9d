"""Factors of symmetric positive definite sparse matrices by one of three libraries.

SciPy's SuperLU is always available. CHOLMOD (scikit-sparse) and PARDISO (pypardiso) are several
times faster from about 20 000 unknowns on, and are used where they are installed.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any, Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from ifem_export.errors import IfemError

Backend = Literal["auto", "superlu", "cholmod", "pardiso"]
BACKENDS: tuple[str, ...] = get_args(Backend)
PARDISO_FROM = 20_000
"""Number of unknowns from which `auto` takes PARDISO; SuperLU solves smaller systems faster."""
_MODULE = {"cholmod": "sksparse", "pardiso": "pypardiso"}
_PACKAGE = {"cholmod": "scikit-sparse", "pardiso": "pypardiso"}


class Factor(Protocol):
    """A factored matrix."""

    @property
    def nnz(self) -> int:
        """Entries that a back-substitution reads."""

    def solve(self, b: NDArray[np.float64]) -> NDArray[np.float64]:
        """A⁻¹ b for b (n,) or (n, k)."""


def installed_backends() -> tuple[str, ...]:
    """Backends that are installed here."""
    found = [name for name in ("cholmod", "pardiso") if find_spec(_MODULE[name]) is not None]
    return (*found, "superlu")


def factored(matrix: sparse.csr_array, backend: Backend = "auto") -> Factor:
    """Factor a symmetric positive definite matrix.

    `auto` takes CHOLMOD if it is installed, else PARDISO for a large matrix, else SuperLU.

    Raises:
        IfemError: The backend is unknown, not installed, or cannot factor the matrix.
    """
    if backend not in BACKENDS:
        raise IfemError(
            f"sparse factor {backend!r}: must be one of {', '.join(BACKENDS)}",
            field="backend",
            value=backend,
        )
    available = installed_backends()
    chosen = _automatic(matrix.shape[0], available) if backend == "auto" else backend
    if chosen not in available:
        raise IfemError(
            f"sparse factor {chosen!r} needs the package {_PACKAGE[chosen]}, which is not "
            f"installed: install it or use {' or '.join(available)}",
            field="backend",
            value=chosen,
        )
    maker = {"superlu": _superlu, "cholmod": _cholmod, "pardiso": _Pardiso}[chosen]
    try:
        factor: Factor = maker(matrix)
    except (ImportError, AttributeError) as error:
        raise IfemError(
            f"the installed {_PACKAGE.get(chosen, chosen)} cannot be used ({error}): use 'superlu'",
            field="backend",
            value=chosen,
        ) from error
    except MemoryError as error:
        raise IfemError(
            f"no memory to factor {matrix.shape[0]} unknowns by {chosen}: use method 'pcg'",
            field="matrix",
        ) from error
    # Each library has errors of its own for a singular or indefinite matrix.
    except Exception as error:
        raise IfemError(
            f"the stiffness matrix cannot be factored by {chosen} ({error})", field="matrix"
        ) from error
    return factor


def _automatic(unknowns: int, available: tuple[str, ...]) -> str:
    if "cholmod" in available:
        return "cholmod"
    return "pardiso" if "pardiso" in available and unknowns >= PARDISO_FROM else "superlu"


def _superlu(matrix: sparse.csr_array) -> Any:
    return splu(
        sparse.csc_array(matrix),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )


def _cholmod(matrix: sparse.csr_array) -> Any:
    return _Cholmod(import_module("sksparse.cholmod").cholesky(sparse.csc_matrix(matrix)))


class _Cholmod:
    """A CHOLMOD factor with the interface of SuperLU's."""

    def __init__(self, factor: Any) -> None:
        self._factor = factor

    @property
    def nnz(self) -> int:
        return int(self._factor.L().nnz)

    def solve(self, b: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(self._factor(b))


class _Pardiso:
    """A PARDISO factor of the upper triangle of a positive definite matrix."""

    def __init__(self, matrix: sparse.csr_array) -> None:
        # Matrix type 2 is real, symmetric and positive definite; only the upper triangle is read.
        self._solver = import_module("pypardiso").PyPardisoSolver(mtype=2)
        self._upper = sparse.csr_matrix(sparse.triu(matrix, format="csr"))
        self._solver.factorize(self._upper)

    @property
    def nnz(self) -> int:
        return int(self._solver.get_iparm(18))

    def solve(self, b: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(self._solver.solve(self._upper, np.asfortranarray(b))).reshape(b.shape)

    def __del__(self) -> None:
        solver = getattr(self, "_solver", None)
        if solver is not None:
            solver.free_memory(everything=True)
