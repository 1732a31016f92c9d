"""`gelslim grippers`: the library of grippers, and one of them with all figures and sources."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import console, given, indented, print_json, say, table
from gelslim.cli.options import AsJson

if TYPE_CHECKING:
    from gelslim_cad.spec.gripper_library import LibraryGripper

DASH = "-"


def grippers(
    name: Annotated[
        str,
        typer.Argument(metavar="[NAME]", help="A gripper of the library.", show_default=False),
    ] = "",
    as_json: AsJson = False,
) -> int:
    """List the grippers of the library, or show one with all figures and sources.

    `gelslim new MINE --gripper NAME` writes a spec with one of them, and in any spec
    `design.mount.gripper: NAME` drills the flange for it.
    """
    from gelslim_cad.spec.gripper_library import gripper_names, library_gripper

    if name:
        gripper = library_gripper(name)
        if as_json:
            print_json({"key": name, **gripper.model_dump(exclude={"format"})})
        else:
            _show(gripper)
        return 0
    rows = {n: _row(library_gripper(n)) for n in gripper_names()}
    if as_json:
        print_json([{"key": n, **row} for n, row in rows.items()])
    else:
        _list(rows)
    return 0


def _row(gripper: LibraryGripper) -> dict[str, Any]:
    """What the list tells of a gripper."""
    return {
        "name": gripper.name,
        "stroke_mm": gripper.stroke_mm,
        "force_n": gripper.force_n,
        "payload_kg": gripper.payload_kg,
        "face": gripper.jaw.face,
        "bolts": len(gripper.jaw.holes_mm),
        "bolt": gripper.jaw.bolt,
        "places_assumed": gripper.places_assumed,
        "summary": gripper.summary,
    }


def _list(rows: dict[str, dict[str, Any]]) -> None:
    shown = table(padding=(0, 1, 0, 0))
    shown.add_column("gripper", no_wrap=True)
    for head in ("stroke mm", "force N", "payload kg"):
        shown.add_column(head, justify="right", no_wrap=True)
    for head in ("jaw", "bolts", "places"):
        shown.add_column(head, no_wrap=True)
    for name, row in rows.items():
        force = DASH if row["force_n"] is None else "{:g}-{:g}".format(*row["force_n"])
        places = "own" if name == "generic" else "assumed" if row["places_assumed"] else "known"
        shown.add_row(
            name,
            DASH if row["stroke_mm"] is None else f"{row['stroke_mm']:g}",
            force,
            DASH if row["payload_kg"] is None else f"{row['payload_kg']:g}",
            row["face"],
            f"{row['bolts']} × {row['bolt']}",
            places,
        )
    console().print(shown)
    say(
        "An axial jaw looks along the finger, a lateral one at the object. Measure places that are "
        "assumed, and give flange_bolt and flange_bolt_spacing_mm."
    )


def _show(gripper: LibraryGripper) -> None:
    say(gripper.name, style="bold")
    say(gripper.summary)
    figures = table("figure", "value", "source", padding=(0, 2, 0, 0))
    for path, value in gripper.figures.items():
        source = gripper.source(path)
        mark = f"[{1 + gripper.sources.index(source)}]" + (" assumed" if source.assumed else "")
        figures.add_row(path, _value(value), mark)
    print()
    console().print(figures)
    print()
    for number, source in enumerate(gripper.sources, 1):
        assumed = "assumed: " if source.assumed else ""
        console().print(indented(f"[{number}] {assumed}{source.text}", 0))


def _value(value: Any) -> str:
    if isinstance(value, tuple) and value and isinstance(value[0], tuple):
        return "; ".join(", ".join(f"{v:g}" for v in place) for place in value)
    if isinstance(value, tuple):
        return " to ".join(f"{v:g}" for v in value)
    return given(value)
