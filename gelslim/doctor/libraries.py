"""Which libraries are installed, in which version, and whether they load."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata

from gelslim_core.optional_library import EXTRAS, installed

REQUIRED = (
    *("numpy", "scipy", "numba", "pydantic", "ruamel.yaml", "typer", "rich", "threadpoolctl"),
    "filelock",
)
DISTRIBUTIONS = {
    "cv2": "opencv-python-headless",
    "PIL": "pillow",
    "gerber_writer": "gerber-writer",
    "mcap_ros2": "mcap-ros2-support",
}
"""Distributions whose name differs from that of their module."""
LOAD_S = 120
_LOADER = """
import importlib, json, sys
found = {}
for name in sys.argv[1:]:
    try:
        importlib.import_module(name)
        found[name] = ""
    except BaseException as error:
        found[name] = f"{type(error).__name__}: {error}"
    print(json.dumps(found), flush=True)
"""


@dataclass(frozen=True)
class Library:
    """A module with its version (empty if it is missing) and the reason if it does not load."""

    module: str
    version: str
    problem: str = ""


@dataclass(frozen=True)
class ExtraState:
    """An extra: whether all of it loads, what it enables, and how to install it."""

    name: str
    ready: bool
    enables: str
    command: str
    libraries: tuple[Library, ...]


def required() -> tuple[Library, ...]:
    """Return the libraries that every installation needs."""
    return tuple(Library(name, version(name)) for name in REQUIRED)


def extras(*, load: bool) -> tuple[ExtraState, ...]:
    """Return every extra; with `load` its modules are imported in another process."""
    present = [m for e in EXTRAS for m in e.modules if installed(m)]
    problems = loading(present) if load else {}
    states = []
    for extra in EXTRAS:
        found = tuple(
            Library(m, version(m) if m in present else "", problems.get(m, ""))
            for m in extra.modules
        )
        ready = all(lib.version and not lib.problem for lib in found)
        states.append(ExtraState(extra.name, ready, extra.enables, extra.command, found))
    return tuple(states)


def version(module: str) -> str:
    """Return the version of the module's distribution, or `unknown`."""
    if not installed(module):
        return ""
    try:
        return metadata.version(DISTRIBUTIONS.get(module, module))
    except metadata.PackageNotFoundError:
        return "unknown"


def loading(modules: Sequence[str]) -> dict[str, str]:
    """Return why each module does not load; empty if it does.

    A library may end its process, so the modules are imported in another one.
    """
    left, problems = list(modules), dict[str, str]()
    while left:
        done, ended = _load(left)
        problems |= done
        left = [m for m in left if m not in done]
        if left:
            problems[left[0]] = ended
            left = left[1:]
    return problems


def _load(modules: Sequence[str]) -> tuple[dict[str, str], str]:
    try:
        run = subprocess.run(
            [sys.executable, "-c", _LOADER, *modules],
            capture_output=True,
            text=True,
            encoding="utf-8",
            errors="replace",
            timeout=LOAD_S,
            check=False,
        )
        lines, ended = run.stdout.splitlines(), f"ends its process with status {run.returncode}"
    except subprocess.TimeoutExpired:
        return {}, f"does not load within {LOAD_S} s"
    except OSError as error:
        return {}, f"no process could be started: {error}"
    whole = [line for line in lines if line.startswith("{")]
    return (json.loads(whole[-1]) if whole else {}), ended
