"""How the tests run: seldom a collection of cycles, and Ctrl-C as at a terminal."""

from __future__ import annotations

import gc
import signal
from collections.abc import Iterator

import pytest

MOST_NEW_OBJECTS = 50_000
"""New objects after which the collector looks for cycles among them."""


@pytest.hookimpl(hookwrapper=True)
def pytest_collection() -> Iterator[None]:
    """Libraries and some 8000 tests are 900 000 objects, which it would walk through many times.

    What the tests leave behind needs no walk for every 700 new objects either: these took a
    twelfth of the time, and the memory of a worker is the same with fewer.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.freeze()
        gc.set_threshold(MOST_NEW_OBJECTS, *gc.get_threshold()[1:])


def pytest_configure() -> None:
    """Shells start a job in the background with SIGINT ignored, and every child inherits that."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
