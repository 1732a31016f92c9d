"""Locks that the system releases when their process ends, however it ends; names of lock files."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from gelslim_core.files.held_interrupt import LetThrough, interrupts_held

_UNSUPPORTED = (errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS)
_POLL_S = 0.1
MOST_BYTES = 255
"""Largest length of a name in bytes on nearly every file system."""
_users: dict[tuple[int, str], int] = {}
"""Open descriptor of each marked file, by process and path."""


@contextlib.contextmanager
def locked(path: Path, waiting: Callable[[Path], None] | None = None) -> Iterator[bool]:
    """Hold an exclusive lock on the file `path`, which is removed afterwards.

    `waiting` is called once if another process holds the lock and this one has to wait. The value
    is False if the file system has no locks; the block then runs without one. Raises OSError if the
    file cannot be made.
    """
    with interrupts_held() as let_through:
        lock = FileLock(path, thread_local=False, fallback_to_soft=False)
        held = _acquired(lock, waiting, let_through)
        try:
            with let_through():
                yield held
        finally:
            # Removed while it is still held: a process that waits for it notices that the name is
            # gone and makes the file again.
            with contextlib.suppress(OSError):
                path.unlink()
            lock.release()
            del lock  # While interrupts are held, because its destructor would swallow one.


def _acquired(
    lock: FileLock, waiting: Callable[[Path], None] | None, let_through: LetThrough
) -> bool:
    """Wait for the lock. Returns False if the file system has no locks."""
    told = False
    while True:
        try:
            lock.acquire(blocking=False)
            return True
        except Timeout:
            with let_through():
                if waiting is not None and not told:
                    waiting(Path(lock.lock_file))
                told = True
                time.sleep(_POLL_S)
        except OSError as error:
            if error.errno not in _UNSUPPORTED:
                raise
            return False


def beside(place: Path, ending: str) -> Path:
    """Path of the hidden file `.NAME` + `ending` in the folder of `place`.

    It names locks and unfinished outputs. If it would be too long, a digest replaces the end of
    NAME, so that every file that can be written can also be locked.
    """
    name = f".{place.name}{ending}"
    if len(os.fsencode(name)) > MOST_BYTES:
        digest = hashlib.sha256(os.fsencode(place.name)).hexdigest()[:16]
        short = place.name
        while len(os.fsencode(f".{short}-{digest}{ending}")) > MOST_BYTES:
            short = short[:-1]
        name = f".{short}-{digest}{ending}"
    return place.with_name(name)


def use(path: Path) -> None:
    """Mark by the file `path` that this process uses a folder, until the process ends.

    Any number of processes may hold the same mark, and a second call changes nothing. On Windows it
    does nothing, because Windows does not remove open files. Raises OSError if the file cannot be
    made.
    """
    if sys.platform == "win32":
        return
    _lock(_descriptor(path), exclusive=False)


def used_elsewhere(path: Path) -> bool:
    """Whether another process holds the mark. A mark of this process is kept."""
    if sys.platform == "win32" or not path.exists():
        return False
    ours = _key(path) in _users
    descriptor = _descriptor(path)
    free = _lock(descriptor, exclusive=True)
    if ours:
        _lock(descriptor, exclusive=False)
    else:
        os.close(_users.pop(_key(path)))
    return not free


def _descriptor(path: Path) -> int:
    key = _key(path)
    if key not in _users:
        _users[key] = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    return _users[key]


def _key(path: Path) -> tuple[int, str]:
    return os.getpid(), os.path.realpath(path)


def _lock(descriptor: int, exclusive: bool) -> bool:
    """Take a lock. Returns False if another process holds one; True without locks."""
    if sys.platform == "win32":
        return True
    import fcntl

    kind = fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH
    try:
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES)
    return True
