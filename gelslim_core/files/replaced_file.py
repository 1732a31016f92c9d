"""Files that are written completely or not at all.

A file is written next to its target as `.0123456789abcdef.part`, forced to the disk and moved into
place. Its writer locks the part, so that the part of a killed process can be distinguished from one
that is being written. The first write of a process into a folder removes the parts that killed
processes left there.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import stat
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import IO, Any

from filelock import lock_descriptor

from gelslim_core.files.held_interrupt import interrupts_held

PART = re.compile(r"\.[0-9a-f]{16}\.part")
_BINARY = getattr(os, "O_BINARY", 0)
_swept: set[tuple[int, str]] = set()


def replace_file(path: str | os.PathLike[str], data: bytes, parents: bool = False) -> None:
    """Write `data` to `path` in one step; `parents` makes the folders above it.

    A link is followed, and a device or pipe is written to directly. Raises an OSError that names
    `path`; an old file is then unchanged.
    """
    with replacement(path, parents) as stream:
        stream.write(data)


def json_bytes(record: Mapping[str, Any]) -> bytes:
    """Return indented UTF-8 JSON with a final newline; NaN is not allowed in it."""
    text = json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False)
    # A lone surrogate, as in a file name of another encoding, becomes its JSON escape.
    return (text + "\n").encode("utf-8", "backslashreplace")


@contextlib.contextmanager
def replacement(path: str | os.PathLike[str], parents: bool = False) -> Iterator[IO[bytes]]:
    """A stream whose content replaces `path` when the block ends without an error.

    Arguments and errors are those of `replace_file`.
    """
    target = Path(os.path.realpath(path))
    try:
        kind = _kind(target)
        if kind == stat.S_IFDIR:
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        if kind not in (0, stat.S_IFREG):
            with open(target, "wb") as stream:
                yield stream
            return
        if parents:
            target.parent.mkdir(parents=True, exist_ok=True)
        sweep(target.parent)
        with _part_beside(target) as stream:
            yield stream
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, os.fspath(path)) from error


def is_part(name: str) -> bool:
    """Whether a name is that of an unfinished file of `replace_file`."""
    return bool(PART.fullmatch(name))


def sweep(folder: Path, again: bool = False) -> None:
    """Remove the parts in `folder` whose writers have ended; once per process unless `again`."""
    key = (os.getpid(), os.fspath(folder))
    if key in _swept and not again:
        return
    _swept.add(key)
    with contextlib.suppress(OSError):
        for name in [entry.name for entry in os.scandir(folder) if is_part(entry.name)]:
            with contextlib.suppress(OSError):
                _remove_orphan(folder / name)


@contextlib.contextmanager
def _part_beside(target: Path) -> Iterator[IO[bytes]]:
    with interrupts_held() as let_through:
        part, descriptor = _new_part(target.parent)
        try:
            # closefd=False: the lock ends with the descriptor, which must outlive the stream.
            with let_through(), open(descriptor, "wb", closefd=False) as stream:
                yield stream
                stream.flush()
                os.fsync(descriptor)
            if sys.platform == "win32":  # Windows moves no open file.
                os.close(descriptor)
                descriptor = -1
            os.replace(part, target)
        except BaseException:
            with contextlib.suppress(OSError):
                part.unlink()
            raise
        finally:
            if descriptor >= 0:
                os.close(descriptor)


def _new_part(folder: Path) -> tuple[Path, int]:
    while True:
        part = folder / f".{os.urandom(8).hex()}.part"
        descriptor = os.open(part, os.O_RDWR | os.O_CREAT | os.O_EXCL | _BINARY, 0o666)
        # Another process may have found and removed it before it was locked.
        if _locked(descriptor) is not False and os.fstat(descriptor).st_nlink:
            return part, descriptor
        os.close(descriptor)


def _remove_orphan(part: Path) -> None:
    descriptor = os.open(part, os.O_RDWR | _BINARY)
    try:
        if _locked(descriptor):
            part.unlink()
    finally:
        os.close(descriptor)


def _locked(descriptor: int) -> bool | None:
    """Lock the file until the descriptor is closed; None where the file system has no locks."""
    try:
        return lock_descriptor(descriptor, blocking=False)
    except OSError:
        return None


def _kind(target: Path) -> int:
    """Type of the file at `target`; 0 if there is none."""
    try:
        return stat.S_IFMT(os.stat(target).st_mode)
    except FileNotFoundError:
        return 0
