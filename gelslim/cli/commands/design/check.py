"""`gelslim check`: the design rules and what limits the thickness."""

from __future__ import annotations

from dataclasses import asdict
from itertools import groupby
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim.cli.answer import OK, RULE_FAILED, console, indented, number, print_json, say
from gelslim.cli.options import AsJson, SpecFile

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gelslim_cad.checks import Check

ORDER = {"fail": 0, "warn": 1, "pass": 2}
STYLE = {"fail": "bold red", "warn": "yellow", "pass": "green"}
MARK = {"fail": "FAIL", "warn": "warn", "pass": "ok"}


def check(
    spec: SpecFile,
    as_json: AsJson = False,
    verbose: Annotated[
        bool, typer.Option("-v", "--verbose", help="Print the rules that hold as well.")
    ] = False,
) -> int:
    """Check the design rules and say what limits the thickness.

    Prints each rule that fails or warns with reason and remedy, and what each concession would
    save. Makes no CAD and takes about a second. The exit status is 1 if a rule fails.
    """
    from gelslim_cad.checks import check as apply_rules
    from gelslim_cad.checks.binding import binding_sentences
    from gelslim_cad.dimensions import derive
    from gelslim_cad.tolerance.asked import read_spec

    loaded = read_spec(spec)
    dimensions = derive(loaded.spec)
    checks = apply_rules(dimensions)
    binding = binding_sentences(loaded.spec, dimensions)
    failed = any(c.status == "fail" for c in checks)
    if as_json:
        print_json(
            {
                "format": "gelslim-checks/1",
                "name": loaded.spec.name,
                "ok": not failed,
                "checks": [asdict(c) for c in checks],
                "binding": binding,
            }
        )
    else:
        print_problems(checks)
        if verbose:
            print_held(checks)
        for sentence in binding:
            say(sentence)
        say(summary(loaded.spec.name, checks), style=STYLE["fail" if failed else "pass"])
    return RULE_FAILED if failed else OK


def summary(name: str, checks: Sequence[Check]) -> str:
    """Return a line with the number of rules that fail and warn."""
    count = {s: sum(c.status == s for c in checks) for s in ORDER}
    if count["fail"]:
        some = f"{count['fail']} of {len(checks)} design rules fail"
    else:
        some = f"all {len(checks)} design rules hold"
    warnings = f", {count['warn']} warning{'s' if count['warn'] > 1 else ''}"
    return f"{name}: {some}{warnings if count['warn'] else ''}."


def print_problems(checks: Sequence[Check]) -> None:
    """Print the rules that fail, then those that warn, each with reason and remedy."""
    from rich.text import Text

    screen = console()
    for c in sorted(checks, key=lambda c: ORDER[c.status]):
        if c.status == "pass":
            continue
        head = Text(f"{MARK[c.status]:<5}", style=STYLE[c.status])
        head.append(f"{c.title} ({c.id})", style="bold")
        screen.print(head)
        screen.print(indented(f"{c.reason}.", 5))
        screen.print(indented(f"To do: {c.advice}. Change {c.parameter}.", 5))


def print_held(checks: Sequence[Check]) -> None:
    """Print a table of the rules that hold."""
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 1))
    table.add_column("")
    table.add_column("rules that hold", overflow="fold")
    for column in ("value", "limit", "margin"):
        table.add_column(column, justify="right", no_wrap=True)
    held = [c for c in checks if c.status == "pass"]
    for group, rows in groupby(held, lambda c: c.group):
        table.add_row("", Text(group, style="bold"), "", "", "")
        for c in rows:
            free = c.limit is None
            sign = "≥" if c.sense == "min" else "≤"
            table.add_row(
                Text(MARK[c.status], style=STYLE[c.status]),
                c.title,
                number(c.value, c.unit),
                "no limit" if free else f"{sign} {number(c.limit, c.unit)}",
                "" if free else number(c.margin, c.unit),
            )
    console().print(table)
