"""Factors of symmetric positive definite sparse matrices, by whichever library is installed.

SciPy's SuperLU is always there. CHOLMOD (scikit-sparse) and PARDISO (pypardiso) factor several
times faster from some 20 000 unknowns on; they are loaded only when asked for or found.
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
"""Unknowns from which `auto` takes PARDISO: below, SuperLU's back-substitution is quicker."""
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

    `auto` takes CHOLMOD where installed, else PARDISO for a large matrix, else SuperLU.

    Raises:
        IfemError: unknown backend, one that is not installed, or a matrix it cannot factor.
    """
    if backend not in BACKENDS:
        raise IfemError(f"sparse factor {backend!r}: must be one of {', '.join(BACKENDS)}")
    available = installed_backends()
    chosen = _automatic(matrix.shape[0], available) if backend == "auto" else backend
    if chosen not in available:
        raise IfemError(
            f"sparse factor {chosen!r} needs the package {_PACKAGE[chosen]}, which is not "
            f"installed: install it or use {' or '.join(available)}"
        )
    maker = {"superlu": _superlu, "cholmod": _cholmod, "pardiso": _Pardiso}[chosen]
    try:
        factor: Factor = maker(matrix)
    except (ImportError, AttributeError) as error:
        raise IfemError(
            f"the installed {_PACKAGE.get(chosen, chosen)} cannot be used ({error}): use 'superlu'"
        ) from error
    except MemoryError as error:
        raise IfemError(
            f"no memory to factor {matrix.shape[0]} unknowns by {chosen}: use method 'pcg'"
        ) from error
    # Each library has errors of its own for a singular or indefinite matrix.
    except Exception as error:
        raise IfemError(f"the stiffness matrix cannot be factored by {chosen} ({error})") from error
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
    """A CHOLMOD factor behind the names of SuperLU's."""

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
        # Matrix type 2 is real, symmetric, positive definite; it reads the upper triangle only.
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
