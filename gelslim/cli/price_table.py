"""The price of a changed finger, as a table and as data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gelslim.cli.answer import console, number, say, table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gelslim_cad.explore.price import Figure, Measured, Price

STYLE = {"better": "green", "worse": "bold red", "": ""}
SHARES = ("force.error",)
"""Figures that are shown in per cent."""


def price_record(prices: Sequence[Price]) -> list[dict[str, Any]]:
    """Return each figure with both values, its relative change, and `better` or `worse`."""
    return [
        {
            "name": p.figure.name,
            "what": p.figure.words,
            "unit": p.figure.unit,
            "before": p.before,
            "after": p.after,
            "change": p.change,
            "verdict": p.verdict,
        }
        for p in prices
    ]


def print_prices(title: str, prices: Sequence[Price], before: str, after: str) -> None:
    """Print a table of all figures with both values and the change in per cent."""
    from rich.text import Text

    rows = table(title, figures=(before, after, "change"))
    rows.add_column("", no_wrap=True)
    for p in prices:
        rows.add_row(
            p.figure.words,
            figure_text(p.figure, p.before),
            figure_text(p.figure, p.after),
            per_cent(p.change),
            Text(p.verdict, style=STYLE[p.verdict]),
        )
    print()
    console().print(rows)


def print_broken(name: str, found: Measured) -> None:
    """Print which rules fail, so that light and force error were not computed."""
    if found.failed:
        say(f"{name} breaks {', '.join(found.failed)}, so light and force error were not computed.")


def figure_text(figure: Figure, value: float | None) -> str:
    """Return a figure as text."""
    if value is None:
        return "–"
    if figure.name in SHARES:
        return f"{100 * value:.1f} %"
    return number(value, figure.unit)


def per_cent(change: float | None) -> str:
    """Return a relative change as text."""
    from gelslim_cad.explore.price import SAME

    if change is None:
        return "–"
    if abs(change) < SAME:
        return "same"
    digits = 0 if abs(change) >= 1 else 1
    return f"{100 * change:+.{digits}f} %"
