"""`gelslim diff`: what changes from one spec to another."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import console, given, number, print_json, say, table
from gelslim.cli.options import AsJson, SpecFile
from gelslim.cli.price_table import price_record, print_broken, print_prices
from gelslim_core.optional_library import install_command

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gelslim_cad.compare import Change, Comparison, PartChanges, RuleChange

LEAST_WIDTH = 17
"""Of the names of rules; longer ones are folded."""
STYLE = {"gets worse": "bold red", "gets better": "green", "moves": ""}
FIRST = ("finger.thickness_mm", "finger.width_mm", "finger.length_mm")
WIDE = 100
"""Width in characters from which the table has a column with the meaning."""


def diff(
    first: SpecFile,
    second: SpecFile,
    parts: Annotated[
        bool, typer.Option(help="Compare the solids too (some seconds; needs the extra cad).")
    ] = True,
    price: Annotated[
        bool, typer.Option(help="Trace the light and compute the force error of both.")
    ] = True,
    as_json: AsJson = False,
) -> int:
    """Compare two specs.

    Prints the fields, dimensions, rules, parts and blocks of the bundle that change, and what the
    second finger costs against the first. Nothing is built. The exit status is 0 whether or not
    they differ.
    """
    from gelslim_cad.compare import compare
    from gelslim_cad.explore.price import measured, prices
    from gelslim_cad.tolerance.asked import read_spec

    one, two = read_spec(first), read_spec(second)
    found = compare(one.spec, two.spec)
    made, note = _parts(one, two) if parts and not found.same else (None, "")
    costs = () if found.same or not price else (measured(one.spec), measured(two.spec))
    if as_json:
        record = _record(str(first), str(second), found, made, note)
        print_json({**record, "price": price_record(prices(*costs)) if costs else None})
        return 0
    _report(str(first), str(second), found)
    _report_parts(made, note)
    if costs:
        print_prices("what it costs", prices(*costs), "before", "after")
        print_broken(str(first), costs[0])
        print_broken(str(second), costs[1])
    return 0


def _parts(one: Any, two: Any) -> tuple[PartChanges | None, str]:
    """Return the changed parts, or why they could not be compared."""
    from gelslim_core.optional_library import installed

    if not installed("cadquery"):
        return None, f"not compared: cadquery is missing; run: {install_command('cad')}"
    from gelslim_cad.compare import part_changes
    from gelslim_cad.solids.shapes import SolidError

    try:
        return part_changes(one, two), ""
    except SolidError as error:
        return None, f"not compared: {error}"


def _record(
    first: str, second: str, found: Comparison, made: PartChanges | None, note: str
) -> dict[str, Any]:
    return {
        "format": "gelslim-diff/1",
        "first": first,
        "second": second,
        "same": found.same,
        "fields": [{**asdict(c), "difference": c.difference} for c in found.fields],
        "dimensions": [{**asdict(c), "difference": c.difference} for c in found.dimensions],
        "rules": [
            {"id": c.id, "verdict": c.verdict, "before": asdict(c.before), "after": asdict(c.after)}
            for c in found.rules
        ],
        "bundle": [asdict(c) for c in found.bundle],
        "parts": None if made is None else asdict(made),
        "parts_note": note,
    }


def _report(first: str, second: str, found: Comparison) -> None:
    from rich.text import Text

    if found.same:
        say(f"{first} and {second} give the same finger.")
        return
    _changes("fields of the spec", found.fields, every=True)
    _changes("dimensions that follow", found.dimensions)
    if found.rules:
        rows = table("design rules", figures=("before", "after", "limit", "margin"))
        rows.columns[0].min_width, rows.columns[0].overflow = LEAST_WIDTH, "fold"
        rows.add_column("", no_wrap=True)
        order = list(STYLE)
        shown = [c for c in found.rules if _shows(c)]
        for c in sorted(shown, key=lambda c: (order.index(c.verdict), c.after.status != "fail")):
            b, a = c.before, c.after
            rows.add_row(
                c.id,
                number(b.value, b.unit),
                number(a.value, a.unit),
                _limit(b.limit, a.limit),
                "" if a.margin is None else number(a.margin),
                Text(
                    f"{b.status} → {a.status}" if b.status != a.status else a.status,
                    style=STYLE[c.verdict],
                ),
            )
        console().print(rows)
        _note_unshown(len(found.rules) - len(shown))
        print()
    for block in found.bundle:
        words = f"{block.before} → {block.after}" if block.before != block.after else block.after
        say(f"bundle, {block.block}: {words}")


def _shows(change: RuleChange) -> bool:
    """Return whether the printed digits show the change."""
    b, a = change.before, change.after
    pairs = ((b.value, a.value), (b.limit, a.limit))
    return b.status != a.status or any(number(x) != number(y) for x, y in pairs)


def _note_unshown(count: int) -> None:
    if count:
        print(f"{count} more differ{'s' if count == 1 else ''} only in digits that are not shown.")


def _limit(before: float | None, after: float | None) -> str:
    from gelslim_cad.compare import differ

    if differ(before, after):
        return f"{number(before)} → {number(after)}"
    return number(after)


def _changes(title: str, changes: Sequence[Change], every: bool = False) -> None:
    """Print a table of the changes: of `every` one, or of those that the digits show."""
    spelt = given if every else number
    if not changes:
        return
    screen = console()
    rows = table()
    rows.add_column(title, no_wrap=True)
    for column in ("before", "after", "difference"):
        rows.add_column(column, justify="right", overflow="fold")
    told = screen.width >= WIDE
    if told:
        rows.add_column("", style="dim", overflow="fold")
    shown = [c for c in changes if every or number(c.before) != number(c.after)]
    for c in sorted(shown, key=lambda c: c.name not in FIRST):
        step = c.difference
        cells = (
            c.name,
            spelt(c.before, c.unit),
            spelt(c.after, c.unit),
            "" if step is None else f"{'+' if step > 0 else ''}{number(step, c.unit)}",
            c.meaning,
        )
        rows.add_row(*cells[: 5 if told else 4])
    screen.print(rows)
    _note_unshown(len(changes) - len(shown))
    print()


def _report_parts(made: PartChanges | None, note: str) -> None:
    if note:
        say(f"parts: {note}")
    if made is None:
        return
    rows = table("parts", "", figures=("volume before", "after", "size after"))
    for c in (c for c in made.changed if c.how != "moved"):
        rows.add_row(
            c.name,
            c.how,
            "" if c.volume_before_mm3 is None else number(c.volume_before_mm3, "mm³"),
            "" if c.volume_after_mm3 is None else number(c.volume_after_mm3, "mm³"),
            _size(c.size_after_mm),
        )
    print()
    console().print(rows)
    moved = [c.name for c in made.changed if c.how == "moved"]
    if moved:
        say(f"Only moved: {', '.join(moved)}.")
    if made.kept:
        say(f"Unchanged: {', '.join(made.kept)}.")
    say(f"A build has to repeat {len(made.units)} units of work.")


def _size(sides: tuple[float, float, float] | None) -> str:
    return "" if sides is None else " × ".join(f"{s:.1f}" for s in sides)
