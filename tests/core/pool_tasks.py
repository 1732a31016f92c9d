"""Tasks for the engine's tests; workers import them by name."""

from __future__ import annotations

import os
import signal
import threading
from pathlib import Path


def square(value: int) -> int:
    return value * value


ready = threading.Semaphore(0)
"""Counts the calls of `get_ready` by workers that are threads of the test."""


def get_ready() -> None:
    ready.release()


def dies_once(task: tuple[str, int]) -> int:
    """Kill the worker the first time that task 3 comes up."""
    folder, value = task
    mark = Path(folder) / "died"
    if value == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    with (Path(folder) / f"done_{value}").open("a") as log:
        log.write("x")
    return value * value


def always_dies(value: int) -> int:
    if value == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return value


def fails(value: int) -> int:
    raise ValueError(f"task {value} cannot be done")
