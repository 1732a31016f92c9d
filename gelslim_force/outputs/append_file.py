"""A file that grows by whole pieces: a piece is with the kernel when `append` returns."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path


class AppendFile:
    """Outlives a kill of the process up to the last piece appended; not a loss of power."""

    def __init__(self, path: Path) -> None:
        """Create the file. Raises OSError, FileExistsError where it is there already."""
        self.path = path
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | getattr(os, "O_BINARY", 0)
        self._file = os.open(path, flags, 0o644)
        self._length = 0

    def append(self, piece: bytes) -> None:
        """Write a piece whole; where the disk refuses, take back its part and raise OSError."""
        left = memoryview(piece)
        try:
            while left:
                left = left[os.write(self._file, left) :]
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, self._length)
            raise
        self._length += len(piece)

    def sync(self) -> None:
        """Force what was appended to the disk. Raises OSError."""
        if self._file >= 0:
            os.fsync(self._file)

    def close(self) -> None:
        """Close; again is harmless."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
