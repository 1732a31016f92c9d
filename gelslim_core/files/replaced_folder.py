"""A folder that is replaced in one step, and a folder for temporary files.

The new content is written next to the old folder and then exchanged with it. The next writer
removes what a killed writer left.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import shutil
import sys
import tempfile
from collections.abc import Collection, Iterator
from pathlib import Path

from gelslim_core.files.file_lock import beside, locked
from gelslim_core.files.held_interrupt import interrupts_held

_AT_FDCWD = -100
_EXCHANGE = 2
_PREFIX = "gelslim-"
_LOCK = ".lock"


class FolderError(OSError):
    """A folder must not or cannot be replaced; the message says why and what to do."""


@contextlib.contextmanager
def replaced_folder(target: Path, ours: Collection[str]) -> Iterator[Path]:
    """An empty folder that replaces `target` when the block ends without an error.

    `ours` are the paths in `target`, with slashes, that its last writer wrote; they are removed.
    Any other file there belongs to the user and is kept. Raises FolderError if such a file has the
    name of a new one or the folder cannot be moved, and OSError otherwise; `target` is then
    unchanged.
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
    """Remove what a killed writer left next to `target`, also if nothing new will be written.

    If the writer was killed between its two renames, the old folder is restored. The caller holds
    the lock that every writer of `target` holds. Raises OSError.
    """
    place = Path(os.path.realpath(target))
    retired = _retired(place)
    if retired.is_dir() and not place.exists():
        os.rename(retired, place)
    for left in (retired, _staging(place)):
        shutil.rmtree(left, ignore_errors=True)


def _require_movable(place: Path, given: Path) -> None:
    here = Path.cwd()
    if place == here or place in here.parents:
        raise FolderError(
            f"{given}: is the current folder, and the whole output folder is replaced; "
            "choose a folder of its own"
        )
    if os.path.ismount(place):
        raise FolderError(
            f"{given}: is a mount point, which cannot be replaced; choose a folder inside it"
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
                    f"{path}: is not from the last run, and this run would replace it; move it away"
                )
            new.parent.mkdir(parents=True, exist_ok=True)
            try:
                os.link(path, new, follow_symlinks=False)
            except (OSError, NotImplementedError):
                shutil.copy2(path, new, follow_symlinks=False)


def _swap(staging: Path, place: Path) -> None:
    """Move `staging` to `place` and remove the old folder."""
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
    """Exchange both folders in one step. Returns False if the system cannot."""
    if not sys.platform.startswith("linux"):
        return False
    try:
        swap = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError):
        return False
    names = (os.fsencode(staging), os.fsencode(place))
    return bool(swap(_AT_FDCWD, names[0], _AT_FDCWD, names[1], _EXCHANGE) == 0)


@contextlib.contextmanager
def scratch_folder() -> Iterator[Path]:
    """A new folder for temporary files, which is removed afterwards.

    The folders of processes that were killed are removed too. Raises OSError if the system has no
    place for temporary files.
    """
    sweep_scratch()
    folder = Path(tempfile.gettempdir()) / f"{_PREFIX}{os.urandom(8).hex()}"
    with locked(folder.with_suffix(_LOCK)), interrupts_held() as let_through:
        try:
            folder.mkdir(mode=0o700)
            with let_through():
                yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)


def sweep_scratch() -> None:
    """Remove the temporary folders of processes that were killed."""
    for lock in list(Path(tempfile.gettempdir()).glob(f"{_PREFIX}????????????????{_LOCK}")):
        with contextlib.suppress(OSError), locked(lock, _leave_alone) as held:
            if held:
                shutil.rmtree(lock.with_suffix(""), ignore_errors=True)


def _leave_alone(lock: Path) -> None:
    raise BlockingIOError
