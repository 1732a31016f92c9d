"""Linear algebra on one thread, so that results do not depend on the number of processors.

BLAS splits sums among its threads, so the last bits of a sum differ with the number of
processors. In a fit or a covariance that is computed from such sums, more than the last bits
differ. Within one frame, waking further threads also costs more time than it saves.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import Any, TypeVar

import scipy.linalg  # noqa: F401  (loads its own BLAS, which must be there to be limited)
from threadpoolctl import LibController, ThreadpoolController

Wrapped = TypeVar("Wrapped", bound=Callable[..., Any])


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


@cache
def _libraries() -> tuple[LibController, ...]:
    """The BLAS libraries that are loaded."""
    return tuple(lib for lib in _controller().lib_controllers if lib.user_api == "blas")


def single_threaded(function: Wrapped) -> Wrapped:
    """Run `function` with one BLAS thread, and restore the number of threads after it."""

    @wraps(function)
    def limited(*args: Any, **kwargs: Any) -> Any:
        if all(library.num_threads == 1 for library in _libraries()):
            return function(*args, **kwargs)
        with _controller().limit(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return limited  # type: ignore[return-value]
