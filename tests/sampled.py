"""Choice of the cases that every run tries; the others are left to the slow tests."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import pytest


def quick(values: Iterable[Any], chosen: Callable[[Any], bool]) -> list[Any]:
    """Cases of one parameter; those that are not chosen are marked as slow."""
    return [
        value if chosen(value) else pytest.param(value, marks=pytest.mark.slow) for value in values
    ]
