"""Marks that a folder is in use by processes that must not have it changed under them."""

from __future__ import annotations

import os
import sys
from pathlib import Path

_users: dict[tuple[int, str], int] = {}


def use(path: Path) -> None:
    """Hold the mark `path` along with any others until this process ends; again is harmless.

    Raises OSError where the file cannot be made. Nothing on Windows, which keeps files that are
    open from being removed.
    """
    if sys.platform == "win32":
        return
    _lock(_descriptor(path), exclusive=False)


def used_elsewhere(path: Path) -> bool:
    """Whether a process other than this holds the mark; a mark of this one is kept."""
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
    """False where another process is in the way; True where the file system has no locks."""
    if sys.platform == "win32":
        return True
    import errno
    import fcntl

    kind = fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH
    try:
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES)
    return True
