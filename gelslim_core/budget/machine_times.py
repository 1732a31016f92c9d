"""Times measured on this machine, kept in the user's cache; never inside a bundle or a result.

One small file per machine and ladder, so that a home directory shared by many machines serves each
its own. A file that cannot be read is as good as none: times are measured again at will.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import platform
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

FORMAT = "gelslim-machine-times/1"
FOLDER_VARIABLE = "GELSLIM_CACHE_DIR"


@dataclass(frozen=True)
class Machine:
    """What the times of a ladder depend on."""

    name: str
    processor: str
    cores: int
    system: str

    @property
    def key(self) -> str:
        """Tells machines apart, in a file's name."""
        parts = (self.name, self.processor, str(self.cores), self.system)
        return hashlib.sha256("|".join(parts).encode()).hexdigest()[:16]

    def __str__(self) -> str:
        return f"{self.processor}, {self.cores} cores, {self.system}"


@cache
def this_machine() -> Machine:
    """The machine that this runs on."""
    return Machine(platform.node(), _processor(), os.cpu_count() or 1, platform.system())


def cache_folder() -> Path:
    """Where the times are kept.

    `GELSLIM_CACHE_DIR` where set; else `gelslim` in the system's folder for caches:
    `$XDG_CACHE_HOME` or `~/.cache`, `~/Library/Caches` on macOS, `%LOCALAPPDATA%` on Windows.
    """
    asked = os.environ.get(FOLDER_VARIABLE)
    if asked:
        return Path(asked)
    if sys.platform == "win32":
        place = os.environ.get("LOCALAPPDATA")
        return Path(place or Path.home() / "AppData" / "Local") / "gelslim" / "cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "gelslim"
    place = os.environ.get("XDG_CACHE_HOME")
    # A relative XDG path is to be ignored by its specification.
    base = Path(place) if place and Path(place).is_absolute() else Path.home() / ".cache"
    return base / "gelslim"


def times_path(ladder_key: str) -> Path:
    """The file of one ladder on this machine."""
    return cache_folder() / "times" / this_machine().key / f"{ladder_key}.json"


def require_keeping() -> None:
    """Raises OSError where times cannot be kept: to be asked before measuring them."""
    folder = times_path("any").parent
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass


def read_times(ladder_key: str) -> dict[str, float]:
    """Times in ms by rung, measured on this machine; empty where there are none.

    A file that was carried here from another machine or another sensor is as good as none.
    """
    try:
        found = json.loads(times_path(ladder_key).read_bytes())
        times = {str(name): float(ms) for name, ms in found["times_ms"].items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}
    if (found.get("format"), found.get("ladder"), found.get("machine")) != (
        FORMAT,
        ladder_key,
        asdict(this_machine()),
    ):
        return {}
    return {name: ms for name, ms in times.items() if 0 < ms < math.inf}


def write_times(ladder_key: str, times_ms: Mapping[str, float]) -> Path:
    """Keep the times of a ladder, in one step; returns the file. Raises OSError."""
    path = times_path(ladder_key)
    record: dict[str, Any] = {
        "format": FORMAT,
        "ladder": ladder_key,
        "machine": asdict(this_machine()),
        "times_ms": dict(times_ms),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, part = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write((json.dumps(record, indent=1) + "\n").encode())
        os.replace(part, path)
    except BaseException:
        with contextlib.suppress(OSError):
            Path(part).unlink()
        raise
    return path


def _processor() -> str:
    """The processor's model, as far as the system tells it."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
