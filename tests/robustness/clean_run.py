"""A command's output where nothing disturbed it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sweep_commands import Command


@dataclass(frozen=True)
class CleanRun:
    """What a command writes when nothing disturbs it."""

    folder: Path
    whole: dict[str, str]
    """SHA-256 by file, from the folder above `folder` on."""
    bytes: int
    """Of the files that have to be there; a cache that finds no room is left out."""
    took_s: float


CleanRuns = Callable[[Command], CleanRun]
