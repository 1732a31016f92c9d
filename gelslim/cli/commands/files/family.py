"""`gelslim family`: several fingers, built and drawn side by side."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import (
    OK,
    RULE_FAILED,
    console,
    number,
    print_json,
    progress_bar,
    say,
    table,
)
from gelslim.cli.failure import CommandError
from gelslim.cli.options import AsJson
from gelslim.cli.output import replace_file

if TYPE_CHECKING:
    from gelslim_cad.family import Member
    from gelslim_cad.spec import Spec


def family(
    specs: Annotated[
        list[Path], typer.Argument(metavar="SPEC...", help="The fingers' YAML files.")
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder of all fingers.")] = Path(
        "out/family"
    ),
    jobs: Annotated[
        int | None, typer.Option("-j", "--jobs", min=1, help="Number of processes of each build.")
    ] = None,
    as_json: AsJson = False,
) -> int:
    """Build several fingers and draw them to scale.

    Writes each finger to a folder of its own, and reuses what has not changed. Writes family.png
    and family.csv with their sizes. The exit status is 1 if a finger breaks a design rule; the
    others are still built and drawn.
    """
    from gelslim_cad.tolerance.asked import read_spec
    from gelslim_core.optional_library import require

    started = time.monotonic()
    require("cadquery", "trimesh")
    loaded = [read_spec(s) for s in specs]
    _distinct([x.spec.name for x in loaded])
    built = _built([(s, x.spec) for s, x in zip(specs, loaded, strict=True)], out, jobs, as_json)
    files, note = _draw(out, built.members)
    if as_json:
        print_json(
            {
                "format": "gelslim-family/1",
                "folder": str(out),
                "files": files,
                "members": [_record(m, built.units[m.name]) for m in built.members],
                "refused": built.refused,
                "note": note,
            }
        )
    else:
        _report(built)
        if note:
            print(note)
        if built.members:
            done = time.monotonic() - started
            print(f"{len(built.members)} fingers in {out}/, {', '.join(files)} ({done:.1f} s)")
    return RULE_FAILED if built.refused else OK


@dataclass(frozen=True)
class _Built:
    """The result of each finger, by name."""

    members: list[Member]
    units: dict[str, int]
    """Number of units of work that were not reused from an earlier build."""
    refused: dict[str, str]
    """Reason why a finger is not built."""


def _built(specs: list[tuple[Path, Spec]], out: Path, jobs: int | None, quiet: bool) -> _Built:
    """Build every finger into a folder of its own; list those that break a design rule."""
    from gelslim_cad.build import build_variant
    from gelslim_cad.build.variant import BuildRefusedError
    from gelslim_cad.dimensions import derive
    from gelslim_cad.family import member

    built = _Built([], {}, {})
    with progress_bar(quiet=quiet) as tell:
        for path, spec in specs:
            folder = out / spec.name
            try:
                result = build_variant(path, folder, jobs=jobs, progress=_named(tell, spec.name))
            except BuildRefusedError as error:
                built.refused[spec.name] = str(error)
                continue
            built.units[spec.name] = len(result.rebuilt)
            built.members.append(member(spec.name, derive(spec), folder))
    return built


def _distinct(names: list[str]) -> None:
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise CommandError(
            f"gelslim family: two specs have the name {twice[0]}; give each its own name, "
            "because it is also the name of the folder"
        )


def _named(tell: Any, name: str) -> Any:
    if tell is None:
        return None
    return lambda text, done, total: tell(f"{name}: {text}", done, total)


def _draw(out: Path, members: list[Member]) -> tuple[list[str], str]:
    """Write table and picture; return their names and why there is no picture, if so."""
    from gelslim_cad.explore.table import csv_bytes
    from gelslim_cad.family import family_png
    from gelslim_cad.pictures.window import PictureError

    if not members:
        return [], ""
    rows = [_record(m, 0) for m in members]
    names = [n for n in rows[0] if n.endswith(("_mm", "name"))]
    replace_file(out / "family.csv", csv_bytes({n: [r[n] for r in rows] for n in names}))
    try:
        replace_file(out / "family.png", family_png(members))
    except PictureError as error:
        return ["family.csv"], f"the picture was not drawn: {error}"
    return ["family.csv", "family.png"], ""


def _record(m: Member, rebuilt: int) -> dict[str, Any]:
    return {
        "name": m.name,
        "gel_length_mm": m.gel_mm[0],
        "gel_width_mm": m.gel_mm[1],
        "gel_thickness_mm": m.gel_mm[2],
        "finger_length_mm": m.size_mm[0],
        "finger_width_mm": m.size_mm[1],
        "finger_thickness_mm": m.size_mm[2],
        "folder": str(m.folder),
        "units_rebuilt": rebuilt,
    }


def _report(built: _Built) -> None:
    rows = table("finger", figures=("gel", "thickness", "width", "length", "units built"))
    for m in built.members:
        length, width, thickness = m.size_mm
        rows.add_row(
            m.name,
            f"{m.gel_mm[0]:g} × {m.gel_mm[1]:g} × {m.gel_mm[2]:g} mm",
            *(number(v, "mm") for v in (thickness, width, length)),
            str(built.units[m.name]) if built.units[m.name] else "up to date",
        )
    if built.members:
        console().print(rows)
    for name, message in built.refused.items():
        say(f"{name} is not built: {message}", style="bold red")
