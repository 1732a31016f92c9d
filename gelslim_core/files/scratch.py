"""A folder for temporary files that a killed process does not leave for ever."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from gelslim_core.files.file_lock import locked_new, orphaned, released
from gelslim_core.files.held_interrupt import interrupts_held

_PREFIX = "gelslim-"
_LOCK = ".lock"


@contextlib.contextmanager
def scratch_folder() -> Iterator[Path]:
    """A new folder, removed afterwards, along with those of processes that were killed.

    Raises OSError where the system has no place for temporary files.
    """
    sweep_scratch()
    with interrupts_held() as let_through:
        folder, descriptor = _new(Path(tempfile.gettempdir()))
        try:
            folder.mkdir(mode=0o700)
            with let_through():
                yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)
            with contextlib.suppress(OSError):
                folder.with_suffix(_LOCK).unlink()
            released(descriptor)


def _new(root: Path) -> tuple[Path, int]:
    while True:
        folder = root / f"{_PREFIX}{os.urandom(8).hex()}"
        with contextlib.suppress(FileExistsError):
            descriptor = locked_new(folder.with_suffix(_LOCK))
            if descriptor is not None:
                return folder, descriptor


def sweep_scratch() -> None:
    """Remove the folders of processes that were killed."""
    with contextlib.suppress(OSError):
        for lock in list(Path(tempfile.gettempdir()).glob(f"{_PREFIX}????????????????{_LOCK}")):
            with orphaned(lock) as free:
                if free:
                    shutil.rmtree(lock.with_suffix(""), ignore_errors=True)
                    with contextlib.suppress(OSError):
                        lock.unlink()
