"""What numba loads with the first compiled function that a process calls.

It takes a quarter of a second, whatever the function is. A process that calls `load_numba` before
it forks its workers spares each of them this time.
"""

from __future__ import annotations

from numba import njit


def load_numba() -> None:
    """Call a compiled function that does nothing."""
    _nothing()


@njit(cache=True)
def _nothing() -> None:
    """Nothing."""
