"""One thread for linear algebra: sums do not depend on how many there are, nor wait for each other.

BLAS splits sums by its threads, so their last bits differ with the number of processors; where a
fit or a covariance is made of them, more than the last bits. Within a frame, waking other threads
costs more than it saves.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import Any, TypeVar

import scipy.linalg  # noqa: F401  (brings its own BLAS, which has to be there to be held)
from threadpoolctl import ThreadpoolController

Wrapped = TypeVar("Wrapped", bound=Callable[..., Any])


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


def single_threaded(function: Wrapped) -> Wrapped:
    """Run `function` with one BLAS thread, and give the others back after it."""

    @wraps(function)
    def held(*args: Any, **kwargs: Any) -> Any:
        with _controller().limit(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return held  # type: ignore[return-value]
