"""What was collected lives until the end: the collector of cycles passes over it."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest


@pytest.hookimpl(hookwrapper=True)
def pytest_collection() -> Iterator[None]:
    """Libraries and some 8000 tests are 900 000 objects, which it would walk through many times."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.freeze()
