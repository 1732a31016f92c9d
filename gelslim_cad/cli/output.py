"""Files and folders that commands write: whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sized
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gelslim_cad.dimensions import Dimensions

PAD_RULES = ("gel.", "mesh.", "marker.")
"""Beginnings of the ids of rules that bear on pad, mesh and marker print."""


def replace_file(target: Path, data: bytes) -> None:
    """Write `data` to `target` in one step; folders above it are made. Raises OSError."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, part = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(target)) from error
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        # mkstemp keeps others out; a file the user asked for follows the umask.
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(part, 0o666 & ~mask)
        os.replace(part, target)
    except BaseException:
        Path(part).unlink(missing_ok=True)
        raise


def written(folder: Path, files: Sized) -> str:
    """One line that says what was written where."""
    return f"Wrote {len(files)} files to {folder}{os.sep}"


def require_pad_rules(d: Dimensions, command: str, force: bool) -> None:
    """Raise CommandError (status 1) where a rule on gel, mesh or markers fails."""
    from gelslim_cad.checks import check
    from gelslim_cad.cli.failure import CommandError
    from gelslim_cad.cli.status import RULE_FAILED

    failed = [c for c in check(d) if c.status == "fail" and c.id.startswith(PAD_RULES)]
    if failed and not force:
        lines = [f"  {c.id}: {c.reason}. {c.advice} ({c.parameter})" for c in failed]
        raise CommandError(
            f"{command}: a design rule fails; nothing was written (--force writes anyway)\n"
            + "\n".join(lines),
            RULE_FAILED,
        )
