"""What the commands that calibrate a built sensor write and tell."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gelslim.cli.answer import print_json, say
from gelslim.cli.output import replace_file, require_own_file
from gelslim_core.files.replaced_file import json_bytes


@dataclass(frozen=True)
class CalibrationFiles:
    """Files of one calibration, which take the place of earlier ones of the same kind only.

    Attributes:
        what: What is calibrated, as a refusal names it.
        mark: Begins the format of such files.
        out: The calibration; None for none.
        report: A page; None for none.

    Raises:
        CommandError: A file of another kind has one of these names.
    """

    what: str
    mark: bytes
    out: Path | None
    report: Path | None = None

    def __post_init__(self) -> None:
        if self.out is not None:
            require_own_file(self.out, self.mark, self.what)
        if self.report is not None:
            require_own_file(self.report, b"gelslim", "report of gelslim")

    def answer(
        self,
        record: Mapping[str, Any],
        describe: Callable[[], None],
        *,
        page: Callable[[], str] | None = None,
        as_json: bool = False,
        more: Mapping[str, Any] | None = None,
    ) -> None:
        """Write the files, and print the record with `more` as JSON or what `describe` says."""
        if self.out is not None:
            replace_file(self.out, json_bytes(record))
        if self.report is not None and page is not None:
            replace_file(self.report, page().encode("utf-8"))
        if as_json:
            print_json({**record, **(more or {})})
            return
        describe()
        say(f"Wrote {self.out}." if self.out else "Nothing was written; -o FILE writes the result.")


def tell(diagnosis: Iterable[str], warnings: Iterable[str]) -> None:
    """Print what a calibration found, and its warnings in yellow."""
    for line in diagnosis:
        say(line)
    for line in warnings:
        say(f"Warning: {line}.", style="yellow")
