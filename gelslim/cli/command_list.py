"""The commands as `gelslim --help` lists them: by what they are for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from typer.core import TyperGroup

GROUPS: Mapping[str, tuple[str, ...]] = {
    "Design a finger": ("new", "examples", "check", "derive", "explain", "diff"),
    "Search for one": ("thinner", "explore", "optimise"),
    "Try it before it is built": ("light", "plan", "simulate", "validate"),
    "Make its files": ("build", "family", "markers", "bundle", "bundle-info", "bundle-export"),
    "Measure with it": ("calibrate", "force", "track"),
    "This program": ("doctor", "bench", "schema"),
}
LONGEST = 200
"""Characters of a command's first sentence: all of it; the formatter breaks the line."""


class CommandList(TyperGroup):
    """Lists commands under headings; one that no heading names comes last."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a section for each heading."""
        known = [name for name in self.list_commands(ctx) if not self.commands[name].hidden]
        rest = tuple(n for n in known if all(n not in names for names in GROUPS.values()))
        width = max(map(len, known))
        for title, names in {**GROUPS, "Other": rest}.items():
            rows = [
                (name.ljust(width), self.commands[name].get_short_help_str(LONGEST))
                for name in names
                if name in known
            ]
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)
