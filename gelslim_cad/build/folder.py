"""The output folder of a build: filled beside its place, then swapped in whole.

A killed build leaves the previous output as it was; what it left beside it is removed by the
next build. Two builds of one folder wait for each other.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

AT_FDCWD = -100
RENAME_EXCHANGE = 2


class OutputError(OSError):
    """The output folder cannot be used; the message says why and what to do."""


@contextlib.contextmanager
def locked(target: Path) -> Iterator[None]:
    """Hold the folder's lock file while building; other builds of it wait.

    Raises OutputError when the folder's parent cannot be written.
    """
    lock = target.with_name(f".{target.name}.lock")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle = open(lock, "a+b")  # noqa: SIM115  (held over the whole build)
    except OSError as error:
        raise OutputError(
            f"{target.parent}: cannot be written ({error.strerror}); choose another --out"
        ) from error
    with handle:
        _take(handle.fileno())
        yield


def _take(descriptor: int) -> None:
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(descriptor, msvcrt.LK_LOCK, 1)
    else:
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX)


@contextlib.contextmanager
def staged(target: Path) -> Iterator[Path]:
    """An empty folder that takes the place of `target` when the block ends without an error.

    Raises OutputError when `target` is a file or a folder that no build made.
    """
    require_ours(target)
    staging = target.with_name(f".{target.name}.building")
    try:
        shutil.rmtree(staging, ignore_errors=True)
        staging.mkdir(parents=True)
        yield staging
        _swap(staging, target)
    except OSError as error:
        if isinstance(error, OutputError):
            raise
        raise OutputError(
            f"{target}: cannot be written ({error.strerror or error}); "
            "free some disk space or choose another --out"
        ) from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def require_ours(target: Path) -> None:
    """Raise OutputError when `target` is a file or a folder that no build made."""
    if not target.exists():
        return
    if not target.is_dir():
        raise OutputError(f"{target}: is a file; choose another --out")
    if any(target.iterdir()) and not (target / "manifest.json").is_file():
        raise OutputError(
            f"{target}: holds files that no build wrote and is left alone; choose another --out"
        )


def _swap(staging: Path, target: Path) -> None:
    """Put `staging` in place of `target`; the old folder is removed."""
    if not target.exists():
        os.rename(staging, target)
        return
    if _exchanged(staging, target):
        return
    retired = target.with_name(f".{target.name}.old")
    shutil.rmtree(retired, ignore_errors=True)
    os.rename(target, retired)
    try:
        os.rename(staging, target)
    except OSError:
        os.rename(retired, target)
        raise
    shutil.rmtree(retired, ignore_errors=True)


def _exchanged(staging: Path, target: Path) -> bool:
    """Swap both folders in one step where the system can; False where it cannot."""
    if not sys.platform.startswith("linux"):
        return False
    try:
        swap = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError):
        return False
    paths = (os.fsencode(staging), os.fsencode(target))
    return bool(swap(AT_FDCWD, paths[0], AT_FDCWD, paths[1], RENAME_EXCHANGE) == 0)


def recover(target: Path) -> None:
    """Bring back the old output if a build died between its two renames."""
    retired = target.with_name(f".{target.name}.old")
    if retired.is_dir() and not target.exists():
        os.rename(retired, target)
