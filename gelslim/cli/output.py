"""Files and folders that commands write, completely or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sized
from pathlib import Path
from typing import TYPE_CHECKING

from gelslim.cli.answer import RULE_FAILED
from gelslim.cli.failure import CommandError
from gelslim_core.files.replaced_file import replace_file as whole_file

if TYPE_CHECKING:
    from gelslim_cad.dimensions import Dimensions

MARK_BYTES = 1 << 16
PAD_RULES = ("gel.", "mesh.", "marker.")
"""Beginnings of the ids of rules on pad, mesh and marker print."""


def replace_file(target: Path, data: bytes) -> None:
    """Write `data` to `target` in one step and make the folders above it. Raises OSError."""
    whole_file(target, data, parents=True)


def require_own_file(target: Path, mark: bytes, what: str) -> None:
    """Raise CommandError if `target` is a file without `mark` near its beginning.

    A file of an earlier run may be replaced, a file of the user must not.
    """
    if target.is_file() and not _has_mark(target, mark):
        raise CommandError(
            f"{target} exists and is not a {what}; give another name or remove the file"
        )


def require_own_files(folder: Path, names: Iterable[str], first: str, mark: bytes) -> None:
    """Raise CommandError if `folder` has files of these names that no earlier run wrote.

    A run writes the file `first` before all others, with `mark` near its beginning.
    """
    there = [name for name in names if (folder / name).exists()]
    if there and not _has_mark(folder / first, mark):
        raise CommandError(
            f"{folder}: the file {there[0]} was not written by gelslim and would be replaced; "
            "choose another --out"
        )


def _has_mark(path: Path, mark: bytes) -> bool:
    """Whether a file can be read and has `mark` near its beginning."""
    try:
        with open(path, "rb") as stream:
            return mark in stream.read(MARK_BYTES)
    except OSError:
        return False


def written(folder: Path, files: Sized) -> str:
    """Return a line with the number of files and their folder."""
    return f"Wrote {len(files)} files to {folder}{os.sep}"


def require_pad_rules(d: Dimensions, command: str, force: bool) -> None:
    """Raise CommandError (status 1) if a rule on gel, mesh or markers fails."""
    from gelslim_cad.checks import check

    failed = [c for c in check(d) if c.status == "fail" and c.id.startswith(PAD_RULES)]
    if failed and not force:
        lines = [f"  {c.id}: {c.reason}. {c.advice} ({c.parameter})" for c in failed]
        raise CommandError(
            f"{command}: a design rule fails; nothing was written (--force writes anyway)\n"
            + "\n".join(lines),
            RULE_FAILED,
        )
