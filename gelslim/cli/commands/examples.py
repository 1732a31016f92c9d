"""`gelslim examples`: the designs and scenes that come with the program."""

from __future__ import annotations

from gelslim.cli.options import AsJson


def examples(as_json: AsJson = False) -> int:
    """List the designs and scenes that come with the program.

    `gelslim new --from NAME MINE` copies one of them.
    """
    from rich.table import Table

    from gelslim.cli.answer import console, print_json
    from gelslim.examples import examples as listed

    found = listed()
    if as_json:
        print_json(
            [
                {"name": e.name, "kind": e.kind, "path": str(e.path), "summary": e.summary}
                for e in found
            ]
        )
        return 0
    table = Table("name", "kind", "summary", box=None, padding=(0, 2, 0, 0))
    for entry in found:
        table.add_row(entry.name, entry.kind, entry.summary)
    console().print(table)
    return 0
