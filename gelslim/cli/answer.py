"""Answers of the commands: JSON for programs, tables and sentences for people."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from textwrap import wrap
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console
    from rich.padding import Padding
    from rich.table import Table
    from rich.text import Text

WIDEST = 110


def print_json(content: object) -> None:
    """Print `content` as indented JSON; numbers that JSON lacks become null."""
    print(json.dumps(plain(content), indent=1, ensure_ascii=False, allow_nan=False))


def plain(value: Any) -> Any:
    """Return a value with Python's own scalars, lists for tuples, and None for NaN and infinity."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, tuple | list):
        return [plain(v) for v in value]
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def number(value: Any, unit: str = "") -> str:
    """Return a value as text for people: about four significant digits, then the unit."""
    if value is None:
        return "none"
    if isinstance(value, bool | str):
        return str(value).lower() if isinstance(value, bool) else value
    if isinstance(value, tuple | list):
        return ", ".join(number(v) for v in value) + (f" {unit}" if unit else "")
    size = abs(float(value))
    if size < 1e-6:
        size, value = 0.0, 0.0
    if size == math.floor(size) and size < 1e7:
        text = f"{value:.0f}"
    elif size >= 100:
        text = f"{value:.1f}"
    elif size >= 1:
        text = f"{value:.2f}".rstrip("0").rstrip(".")
    else:
        text = f"{value:.3g}"
    gap = "" if unit in ("", "°", "%") else " "
    return f"{text}{gap}{unit}"


def shown_ms(milliseconds: float | None) -> str:
    """Return a time of a ladder as text; a dash if it was not measured."""
    return "-" if milliseconds is None else f"{milliseconds:.3f} ms"


def given(value: Any, unit: str = "") -> str:
    """Return a value of the spec with up to six digits, as the spec has it, then its unit."""
    if isinstance(value, tuple | list) and not value:
        return "none"
    if isinstance(value, float) and math.isfinite(value) and 1e-4 <= abs(value) < 1e6:
        return f"{value:.6g}{number(0, unit)[1:]}"
    return number(value, unit)


def console() -> Console:
    """Return a console on standard output, at most `WIDEST` wide, with colours on a terminal."""
    from rich.console import Console

    class Screen(Console):
        def on_broken_pipe(self) -> None:
            # rich would exit with 1, but that status means that a design rule fails.
            raise BrokenPipeError

    screen = Screen(highlight=False, markup=False, emoji=False)
    if screen.width > WIDEST:
        screen.width = WIDEST
    return screen


def table(*texts: str, figures: Sequence[str] = (), **style: Any) -> Table:
    """Return a table without lines: columns of text, then right-aligned columns of figures."""
    from rich.table import Table

    made = Table(*texts, **{"box": None, "pad_edge": False, **style})
    for head in figures:
        made.add_column(head, justify="right", no_wrap=True)
    return made


def say(text: str, style: str = "") -> None:
    """Print text, wrapped at the width of the console, but never within a path or another word."""
    screen = console()
    lines = [
        part
        for line in text.split("\n")
        for part in wrap(line, screen.width, break_long_words=False, break_on_hyphens=False) or [""]
    ]
    screen.print("\n".join(lines), style=style or None, no_wrap=True, overflow="ignore", crop=False)


def indented(text: str | Text, by: int) -> Padding:
    """Return text that the console prints with an indentation of `by` characters."""
    from rich.padding import Padding

    return Padding(text, (0, 0, 0, by), expand=False)


OK = 0
RULE_FAILED = 1
BAD_INPUT = 2
FAULT = 3
INTERRUPTED = 130
CLOSED_PIPE = 141


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Callable[[str, int, int], None] | None]:
    """Show a progress bar on standard error if that is a terminal and `quiet` is false."""
    from rich.console import Console

    screen = Console(stderr=True, highlight=False)
    if quiet or not screen.is_terminal:
        yield None
        return
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
    )

    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"))
    # No thread refreshes the bar, because a build forks its workers.
    with Progress(
        *columns, TimeElapsedColumn(), console=screen, transient=True, auto_refresh=False
    ) as bar:
        task = bar.add_task("starting", total=1)

        def tell(text: str, done: int, total: int) -> None:
            bar.update(task, description=text, completed=done, total=total, refresh=True)

        yield tell
