"""Files and folders that commands write: whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Sized
from pathlib import Path
from typing import TYPE_CHECKING

from whole_files.replaced_file import replace_file as whole_file

if TYPE_CHECKING:
    from gelslim_cad.dimensions import Dimensions

PAD_RULES = ("gel.", "mesh.", "marker.")
"""Beginnings of the ids of rules that bear on pad, mesh and marker print."""


def replace_file(target: Path, data: bytes) -> None:
    """Write `data` to `target` in one step; folders above it are made. Raises OSError."""
    whole_file(target, data, parents=True)


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
