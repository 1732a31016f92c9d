"""A folder for temporary files that a killed process does not leave for ever."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from gelslim_core.files.file_lock import locked
from gelslim_core.files.held_interrupt import interrupts_held

_PREFIX = "gelslim-"
_LOCK = ".lock"


@contextlib.contextmanager
def scratch_folder() -> Iterator[Path]:
    """A new folder, removed afterwards, along with those of processes that were killed.

    Raises OSError where the system has no place for temporary files.
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
    """Remove the folders of processes that were killed."""
    for lock in list(Path(tempfile.gettempdir()).glob(f"{_PREFIX}????????????????{_LOCK}")):
        with contextlib.suppress(OSError), locked(lock, _leave_alone) as held:
            if held:
                shutil.rmtree(lock.with_suffix(""), ignore_errors=True)


def _leave_alone(lock: Path) -> None:
    raise BlockingIOError
