"""What a command answers: JSON for programs, tables and words for people."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console


WIDEST = 110


def print_json(content: object) -> None:
    """Print `content` as indented JSON; numbers that JSON lacks become null."""
    print(json.dumps(plain(content), indent=1, ensure_ascii=False, allow_nan=False))


def plain(value: Any) -> Any:
    """`value` with numpy scalars unwrapped, tuples as lists, and NaN and infinity as None."""
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
    """A value for people: four digits that count, no exponent where avoidable, then the unit."""
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
    """Return a time of the ladder; a dash where it was not measured."""
    return "-" if milliseconds is None else f"{milliseconds:.3f} ms"


def given(value: Any, unit: str = "") -> str:
    """A value of the spec as it stands there, up to six digits, then its unit."""
    if isinstance(value, tuple | list) and not value:
        return "none"
    if isinstance(value, float) and math.isfinite(value) and 1e-4 <= abs(value) < 1e6:
        return f"{value:.6g}{number(0, unit)[1:]}"
    return number(value, unit)


def console() -> Console:
    """A console on standard output: colours only on a terminal, at most `WIDEST` wide."""
    from rich.console import Console

    class Screen(Console):
        def on_broken_pipe(self) -> None:
            # rich would exit with 1, which here says that a design rule fails.
            raise BrokenPipeError

    screen = Screen(highlight=False, markup=False, emoji=False)
    if screen.width > WIDEST:
        screen.width = WIDEST
    return screen


def say(text: str, style: str = "") -> None:
    """Print words, wrapped at the console's width."""
    console().print(text, style=style or None)


OK = 0
RULE_FAILED = 1
BAD_INPUT = 2
FAULT = 3
INTERRUPTED = 130
CLOSED_PIPE = 141


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Callable[[str, int, int], None] | None]:
    """A progress bar on a terminal's standard error, nothing elsewhere."""
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
    # No refreshing thread: the build forks its workers.
    with Progress(
        *columns, TimeElapsedColumn(), console=screen, transient=True, auto_refresh=False
    ) as bar:
        task = bar.add_task("starting", total=1)

        def tell(text: str, done: int, total: int) -> None:
            bar.update(task, description=text, completed=done, total=total, refresh=True)

        yield tell
