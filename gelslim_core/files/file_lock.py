"""Locks that the system takes back when their process ends, however it ends."""

from __future__ import annotations

import contextlib
import errno
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from gelslim_core.files.held_interrupt import LetThrough, interrupts_held

_UNSUPPORTED = (errno.ENOLCK, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS)
_POLL_S = 0.1


@contextlib.contextmanager
def locked(path: Path, waiting: Callable[[Path], None] | None = None) -> Iterator[bool]:
    """Hold the lock file `path`, alone among all processes; it is removed afterwards.

    `waiting` is called once where another process holds it and this one has to wait. A file system
    without locks is used without; the value is False then. Raises OSError where the file cannot be
    made.
    """
    with interrupts_held() as let_through:
        lock = FileLock(path, thread_local=False, fallback_to_soft=False)
        held = _acquired(lock, waiting, let_through)
        try:
            with let_through():
                yield held
        finally:
            # Removed while still held: who waits for it notices that the name is gone and
            # makes it anew.
            with contextlib.suppress(OSError):
                path.unlink()
            lock.release()
            del lock  # while interrupts are held: its destructor would swallow one


def _acquired(
    lock: FileLock, waiting: Callable[[Path], None] | None, let_through: LetThrough
) -> bool:
    """Take the lock once it is free; False where the file system has no locks."""
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
