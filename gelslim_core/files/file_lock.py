"""Locks that the system takes back when their process ends, however it ends."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from gelslim_core.files.held_interrupt import LetThrough, interrupts_held

_UNSUPPORTED = (errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS)
_POLL_S = 0.1
_held: set[int] = set()
"""Descriptors that hold a lock here; a forked child must not keep them alive."""


@contextlib.contextmanager
def locked(path: Path, waiting: Callable[[Path], None] | None = None) -> Iterator[None]:
    """Hold the lock file `path`, alone among all processes; it is removed afterwards.

    `waiting` is called once where another process holds it and this one has to wait. A file system
    without locks is used without. Raises OSError where the file cannot be made.
    """
    with interrupts_held() as let_through:
        descriptor = _acquired(path, waiting, let_through)
        try:
            with let_through():
                yield
        finally:
            # Removed while still held: who waits for it notices that the name is gone and
            # makes anew.
            with contextlib.suppress(OSError):
                path.unlink()
            released(descriptor)


def locked_new(path: Path) -> int | None:
    """Make the file `path` and lock it; None where it was swept away in between.

    Raises OSError, FileExistsError where it exists.
    """
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | _BINARY, 0o666)
    _held.add(descriptor)
    # Where it is taken already, a sweeper was quicker and removes the file.
    if try_lock(descriptor) is not False and os.fstat(descriptor).st_nlink:
        return descriptor
    released(descriptor)
    return None


@contextlib.contextmanager
def orphaned(path: Path) -> Iterator[bool]:
    """Whether `path` was made by `locked_new` in a process that is no more; locked meanwhile."""
    try:
        descriptor = os.open(path, os.O_RDWR | _BINARY)
    except OSError:
        yield False
        return
    try:
        yield _has_locks() and try_lock(descriptor) is True
    finally:
        os.close(descriptor)


def released(descriptor: int) -> None:
    """Close a descriptor of `locked_new`, which ends the lock."""
    _held.discard(descriptor)
    os.close(descriptor)


def try_lock(descriptor: int) -> bool | None:
    """Lock without waiting: whether it was free; None where the file system has no locks."""
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return None if error.errno in _UNSUPPORTED else False
    return True


def _acquired(path: Path, waiting: Callable[[Path], None] | None, let_through: LetThrough) -> int:
    told = False
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | _BINARY, 0o666)
        _held.add(descriptor)
        try:
            free = try_lock(descriptor)
            if free is not False and (free is None or _is_named(descriptor, path)):
                return descriptor
        except BaseException:
            released(descriptor)
            raise
        released(descriptor)
        if free is False:
            with let_through():
                if waiting is not None and not told:
                    waiting(path)
                told = True
                time.sleep(_POLL_S)


def _is_named(descriptor: int, path: Path) -> bool:
    """Whether the locked file is still the one of that name."""
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(path))
    except OSError:
        return False


def _has_locks() -> bool:
    # Windows locks ranges and keeps open files from being removed: nothing to sweep by.
    return sys.platform != "win32"


def _forget() -> None:
    for descriptor in _held:
        with contextlib.suppress(OSError):
            os.close(descriptor)
    _held.clear()


_BINARY = getattr(os, "O_BINARY", 0)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
