"""Times measured on this machine, kept in the user's cache, never inside a bundle or a result.

There is one small file per machine and ladder, so that several machines can share a home folder. A
file that cannot be read is ignored: the times can be measured again.
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

from gelslim_core.files.replaced_file import json_bytes, replace_file

FORMAT = "gelslim-machine-times/1"
FOLDER_VARIABLE = "GELSLIM_CACHE_DIR"


@dataclass(frozen=True)
class Machine:
    """The machine on which times were measured."""

    name: str
    processor: str
    cores: int
    system: str

    @property
    def key(self) -> str:
        """Identifies the machine in the name of a folder."""
        parts = (self.name, self.processor, str(self.cores), self.system)
        return hashlib.sha256("|".join(parts).encode()).hexdigest()[:16]

    def __str__(self) -> str:
        return f"{self.processor}, {self.cores} cores, {self.system}"


@cache
def this_machine() -> Machine:
    """The machine that runs this program."""
    return Machine(platform.node(), _processor(), os.cpu_count() or 1, platform.system())


def cache_folder() -> Path:
    """The folder of the cache.

    `GELSLIM_CACHE_DIR` where it is set; otherwise `gelslim` in the system's folder for caches:
    `$XDG_CACHE_HOME` or `~/.cache`, `~/Library/Caches` on macOS, `%LOCALAPPDATA%` on Windows.
    """
    given = os.environ.get(FOLDER_VARIABLE)
    if given:
        return Path(given)
    if sys.platform == "win32":
        place = os.environ.get("LOCALAPPDATA")
        return Path(place or Path.home() / "AppData" / "Local") / "gelslim" / "cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "gelslim"
    place = os.environ.get("XDG_CACHE_HOME")
    # The XDG specification says that a relative path must be ignored.
    base = Path(place) if place and Path(place).is_absolute() else Path.home() / ".cache"
    return base / "gelslim"


def times_path(ladder_key: str) -> Path:
    """The file of one ladder on this machine."""
    return cache_folder() / "times" / this_machine().key / f"{ladder_key}.json"


def require_keeping() -> None:
    """Raise OSError where times cannot be stored. To be called before measuring them."""
    folder = times_path("any").parent
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass


def read_times(ladder_key: str) -> dict[str, float]:
    """Times in ms by name of the rung, measured on this machine; empty where there are none.

    A file that was copied here from another machine or another sensor is ignored.
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
    """Store the times in ms of a ladder atomically; returns the file. Raises OSError."""
    path = times_path(ladder_key)
    record = {
        "format": FORMAT,
        "ladder": ladder_key,
        "machine": asdict(this_machine()),
        "times_ms": dict(times_ms),
    }
    replace_file(path, json_bytes(record), parents=True)
    return path


def _processor() -> str:
    """The model of the processor, as far as the system reports it."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
