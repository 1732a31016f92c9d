"""A validation in words and tables for people."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

    from gelslim_twin.validation.score import Spread
    from gelslim_twin.validation.validation import Validation

NONE = "-"


def print_validation(found: Validation) -> None:
    """What was done, the chains beside the paper, the error budget, the other contacts."""
    from gelslim.cli.answer import console, say

    screen = console()
    tests = found.experiment.tests
    depths = [t.depth_mm for t in tests]
    sizes = [math.hypot(*s.true_n) for s in found.scores]
    say(
        f"Ball of radius {found.experiment.ball.radius_mm:g} mm, pressed {min(depths):.2g} to "
        f"{max(depths):.2g} mm deep at {len(tests)} places, then slid in {len(tests)} directions: "
        f"true forces up to {max(sizes):.2f} N."
    )
    say(f"{found.truth}\n")
    say(
        "Resultant, found minus true: standard deviation and mean of x, y, z in N; error: root "
        "mean square over that of the force; good: frames within 15 % of the force:"
    )
    screen.print(_resultants("chain", found.chains))
    print("\nForce field, medians over the frames:")
    screen.print(_fields(found.chains))
    if found.budget:
        say(
            "\nError budget: the paper's one layer on exact markers, no noise, one thing wrong at "
            "a time:"
        )
        screen.print(_resultants("source", found.budget))
    print("\nOther contacts, last frame, N:")
    screen.print(_others(found))
    for name, scores in found.others.items():
        for score in scores:
            for problem in score.problems:
                say(f"{name}, {score.chain}: {problem}.")


def _table(*heads: str) -> Table:
    from rich.table import Table

    table = Table(box=None, padding=(0, 1, 0, 0))
    for number, head in enumerate(heads):
        table.add_column(head, justify="right" if number else "left", no_wrap=True)
    return table


def _resultants(title: str, rows: Sequence[Spread]) -> Table:
    from gelslim_twin.validation.validation import PAPER_N, PAPER_RELATIVE

    table = _table(title, "deviation", "mean", "error", "good")
    for row in rows:
        table.add_row(
            row.name,
            " ".join(_number(v, "{:.3f}") for v in row.deviation_n),
            " ".join(_number(v, "{:+6.3f}") for v in row.bias_n),
            _number(row.relative, "{:.1%}"),
            _number(row.within, "{:.0%}"),
        )
    paper = " ".join(f"{v:5.3f}" for v in PAPER_N)
    table.add_row("the paper, measured", paper, "", f"{PAPER_RELATIVE:.0%}", "", style="bold")
    return table


def _fields(rows: Sequence[Spread]) -> Table:
    table = _table("chain", "field", "outside", "centre", "direction", "no Fz", "time")
    for row in rows:
        table.add_row(
            row.name,
            _number(row.field_error, "{:.0%}"),
            _number(row.outside_share, "{:.0%}"),
            _number(row.centre_error_mm, "{:.2f} mm"),
            _number(row.direction_error_deg, "{:.1f}°"),
            f"{row.without[2]} of {row.frames}",
            _number(row.milliseconds, "{:.0f} ms"),
        )
    return table


def _others(found: Validation) -> Table:
    table = _table("contact", "Fx", "Fy", "Fz", "field", "outside")
    for name, scores in found.others.items():
        table.add_row(name, *(f"{v:+.3f}" for v in scores[0].true_n), style="bold")
        for score in scores:
            table.add_row(
                f"  {score.chain}",
                *(_number(v, "{:+.3f}") for v in score.found_n),
                _number(score.field_error, "{:.0%}"),
                _number(score.outside_share, "{:.0%}"),
            )
    return table


def _number(value: float, form: str) -> str:
    return form.format(value) if math.isfinite(value) else NONE
