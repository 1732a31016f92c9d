"""What a command answers: JSON for programs, tables and words for people."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
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
