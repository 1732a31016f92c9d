"""One thread for linear algebra within a frame: waking others costs more than it saves."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import Any, TypeVar

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
