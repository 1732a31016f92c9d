"""A folder that is filled beside its place and swapped in whole.

What a killed writer left beside it is removed by the next one.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import shutil
import sys
from collections.abc import Collection, Iterator
from pathlib import Path

from gelslim_core.files.file_lock import beside
from gelslim_core.files.held_interrupt import interrupts_held

_AT_FDCWD = -100
_EXCHANGE = 2


class FolderError(OSError):
    """A folder that must not or cannot be replaced; the message says why and what to do."""


@contextlib.contextmanager
def replaced_folder(target: Path, ours: Collection[str]) -> Iterator[Path]:
    """An empty folder that takes the place of `target` when the block ends without an error.

    `ours` are the paths in `target`, with slashes, that its last writer wrote: they go. Any other
    file there is the user's and is carried over. Raises OSError; FolderError where that file is in
    the way or the folder is one that cannot be moved. `target` is then as it was.
    """
    place = Path(os.path.realpath(target))
    _require_movable(place, target)
    staging = _staging(place)
    with interrupts_held() as let_through:
        try:
            with let_through():
                shutil.rmtree(staging, ignore_errors=True)
                staging.mkdir(parents=True)
                yield staging
                _carry_over(place, staging, ours)
            _swap(staging, place)
        finally:
            shutil.rmtree(staging, ignore_errors=True)


def recover(target: Path) -> None:
    """Remove what a killed writer left beside `target`, for a caller that may write nothing anew.

    The old folder is brought back if the writer was killed between its two renames. The caller
    holds the lock that every writer of `target` holds. Raises OSError.
    """
    place = Path(os.path.realpath(target))
    retired = _retired(place)
    if retired.is_dir() and not place.exists():
        os.rename(retired, place)
    for left in (retired, _staging(place)):
        shutil.rmtree(left, ignore_errors=True)


def _require_movable(place: Path, told: Path) -> None:
    here = Path.cwd()
    if place == here or place in here.parents:
        raise FolderError(
            f"{told}: is the folder you are in, and the output is replaced whole; "
            "name a folder of its own for it"
        )
    if os.path.ismount(place):
        raise FolderError(
            f"{told}: is a mount point, which cannot be replaced whole; name a folder inside it"
        )


def _carry_over(place: Path, staging: Path, ours: Collection[str]) -> None:
    if not place.is_dir():
        return
    for folder, _, names in os.walk(place):
        for name in names:
            path = Path(folder, name)
            inner = path.relative_to(place)
            if inner.as_posix() in ours:
                continue
            new = staging / inner
            if new.exists():
                raise FolderError(
                    f"{path}: is not from the last run, and this one would write it; move it away"
                )
            new.parent.mkdir(parents=True, exist_ok=True)
            try:
                os.link(path, new, follow_symlinks=False)
            except (OSError, NotImplementedError):
                shutil.copy2(path, new, follow_symlinks=False)


def _swap(staging: Path, place: Path) -> None:
    """Put `staging` in place; the old folder is removed."""
    if not place.exists():
        os.rename(staging, place)
        return
    if _exchanged(staging, place):
        return
    retired = _retired(place)
    shutil.rmtree(retired, ignore_errors=True)
    os.rename(place, retired)
    try:
        os.rename(staging, place)
    except OSError:
        os.rename(retired, place)
        raise
    shutil.rmtree(retired, ignore_errors=True)


def _staging(place: Path) -> Path:
    return beside(place, ".building")


def _retired(place: Path) -> Path:
    return beside(place, ".old")


def _exchanged(staging: Path, place: Path) -> bool:
    """Swap both folders in one step where the system can; False where it cannot."""
    if not sys.platform.startswith("linux"):
        return False
    try:
        swap = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError):
        return False
    names = (os.fsencode(staging), os.fsencode(place))
    return bool(swap(_AT_FDCWD, names[0], _AT_FDCWD, names[1], _EXCHANGE) == 0)
