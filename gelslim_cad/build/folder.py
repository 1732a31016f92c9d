"""The output folder of a build, which is replaced as a whole.

The files are written to a folder next to it, which then takes its place. A build that is killed
leaves the previous output as it was, and the next build removes what the killed one left. Two
builds of one folder wait for each other.
"""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Collection, Iterator
from pathlib import Path

from gelslim_core.errors import OutputError
from gelslim_core.files.file_lock import beside
from gelslim_core.files.file_lock import locked as lock_file
from gelslim_core.files.replaced_folder import FolderError, replaced_folder

MANIFEST = "manifest.json"
FAMILY = "gelslim-build/"
"""Beginning of the format in a build's manifest, whatever its version."""


@contextlib.contextmanager
def locked(target: Path) -> Iterator[None]:
    """Hold the folder's lock; another process waits for it and says so.

    Raises:
        OutputError: The folder's parent cannot be written.
    """
    lock = beside(target, ".lock")
    with contextlib.ExitStack() as stack:
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            stack.enter_context(lock_file(lock, lambda _: _say_waiting(target)))
        except OSError as error:
            raise OutputError(
                f"{target.parent}: cannot be written ({error.strerror}); choose another --out"
            ) from error
        yield


def _say_waiting(target: Path) -> None:
    print(f"{target} is being written by another gelslim; waiting for it", file=sys.stderr)


@contextlib.contextmanager
def staged(target: Path, ours: Collection[str] = ()) -> Iterator[Path]:
    """An empty folder that takes the place of `target` when the block ends without an error.

    Files of the last build, `ours`, are removed; any other file is kept.

    Raises:
        OutputError: `target` is a file or a folder that no build made, or cannot be written.
    """
    require_ours(target)
    try:
        with replaced_folder(target, ours) as staging:
            yield staging
    except FolderError as error:
        raise OutputError(str(error)) from error
    except OSError as error:
        raise OutputError(
            f"{target}: cannot be written ({error.strerror or error}); "
            "free some disk space or choose another --out"
        ) from error


def require_ours(target: Path) -> None:
    """Raise OutputError when `target` is a file or a folder that no build made."""
    if not target.exists():
        return
    if not target.is_dir():
        raise OutputError(f"{target}: is a file; choose another --out")
    if any(target.iterdir()) and not _built(target):
        raise OutputError(
            f"{target}: holds files that no build wrote, so it stays as it is; choose another --out"
        )


def _built(folder: Path) -> bool:
    """Whether the folder holds a build's manifest: other programs write a manifest.json too."""
    try:
        found = json.loads((folder / MANIFEST).read_bytes())
    except (OSError, ValueError):
        return False
    return isinstance(found, dict) and str(found.get("format")).startswith(FAMILY)
