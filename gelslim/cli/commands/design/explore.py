"""`gelslim explore`: thousands of designs, with what is feasible and what it costs."""

from __future__ import annotations

import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim.cli.answer import console, number, print_json, progress_bar, say, table
from gelslim.cli.failure import CommandError
from gelslim.cli.options import AsJson, DrawPictures, SpecFile, out_folder
from gelslim.cli.output import replace_file
from gelslim_core.optional_library import install_command

if TYPE_CHECKING:
    from gelslim_cad.explore.study import Exploration

Vary = Annotated[
    list[str],
    typer.Option(
        "--vary", metavar="PATH=VALUES", help="Field and its values, such as 16:50:1 or 2,2.9,4."
    ),
]
Jobs = Annotated[
    int | None,
    typer.Option("-j", "--jobs", min=1, help="Number of processes; by default one per processor."),
]
Scheduler = Annotated[
    str,
    typer.Option(
        metavar="ADDRESS", help="Dask scheduler in place of processes, such as tcp://host:8786."
    ),
]
NoisePx = Annotated[
    float, typer.Option(min=0.0, help="Noise of a marker's position in px, for --force-error.")
]
MOST_REASONS = 5
Rays = Annotated[int, typer.Option(min=1024, max=1 << 24, help="Rays per guide, for --light.")]


def explore(
    spec: SpecFile,
    vary: Vary,
    out: Annotated[Path | None, out_folder("out/NAME-explore")] = None,
    light: Annotated[bool, typer.Option("--light", help="Trace the light of each design.")] = False,
    force_error: Annotated[
        bool, typer.Option("--force-error", help="Compute the expected force error of each design.")
    ] = False,
    column: Annotated[
        list[str] | None, typer.Option(help="A further dimension for the table; may be repeated.")
    ] = None,
    jobs: Jobs = None,
    scheduler: Scheduler = "",
    rays: Rays = 1 << 13,
    marker_noise_px: NoisePx = 0.05,
    pictures: DrawPictures = True,
    as_json: AsJson = False,
) -> int:
    """Explore every combination of some values.

    Computes dimensions and design rules of each design, and on request its light and expected
    force error. Writes a table (CSV, and Parquet if pyarrow is installed), Pareto plots, and a map
    of what is feasible and what limits the other designs. After an interrupt, run it again: it
    continues where it stopped.
    """
    from gelslim_cad.explore.space import ExploreError, Space, parse_axis
    from gelslim_cad.explore.study import Request
    from gelslim_cad.explore.study import explore as run
    from gelslim_cad.tolerance.asked import read_spec
    from gelslim_core.jobs import Engine, processors

    started = time.monotonic()
    loaded = read_spec(spec)
    folder = out or Path("out") / f"{loaded.spec.name}-explore"
    try:
        space = Space.of(loaded.spec, [parse_axis(v) for v in vary])
        request = Request(space, light, force_error, tuple(column or ()), rays, marker_noise_px)
        with progress_bar(quiet=as_json) as tell:
            found = run(request, folder, Engine(jobs or processors(), scheduler), tell)
    except ExploreError as error:
        raise CommandError(f"gelslim explore: {error}") from error
    files = write_exploration(folder, found, pictures=pictures)
    if as_json:
        print_json({**_record(found), "folder": str(folder), "files": files})
        return 0
    _report(found)
    print(f"Wrote {', '.join(files)} to {folder}/ ({time.monotonic() - started:.1f} s)")
    return 0


def write_exploration(folder: Path, found: Exploration, *, pictures: bool) -> list[str]:
    """Write table and pictures and return their names; leave out what needs a missing library."""
    import sys

    from gelslim_cad.explore.table import csv_bytes, parquet_bytes
    from gelslim_core.optional_library import installed

    made = {"designs.csv": csv_bytes(found.columns)}
    notes = []
    if installed("pyarrow"):
        made["designs.parquet"] = parquet_bytes(found.columns)
    else:
        notes.append(f"the Parquet table was left out; run: {install_command('record')}")
    if pictures and installed("matplotlib"):
        from gelslim_cad.explore.figures import feasibility_png, pareto_png

        made |= {"pareto.png": pareto_png(found), "feasibility.png": feasibility_png(found)}
    elif pictures:
        notes.append(f"the pictures were left out; run: {install_command('plot')}")
    for name, data in made.items():
        replace_file(folder / name, data)
    for note in notes:
        print(note, file=sys.stderr)
    return list(made)


def _record(found: Exploration) -> dict[str, object]:
    from gelslim_cad.explore.pareto import THICKNESS, TRADES, front

    rows = found.rows_where("feasible")
    fronts = {}
    for goal in (g for g in TRADES if g.name in found.columns):
        x, y = ([found.columns[c][k] for k in rows] for c in (THICKNESS.name, goal.name))
        fronts[goal.name] = [rows[k] for k in front(x, goal.costs(y))]
    return {
        "format": "gelslim-explore/1",
        "name": found.space.spec.name,
        "designs": found.space.count,
        "axes": {a.path: a.values for a in found.space.axes},
        "feasible": len(rows),
        "illegal": len(found.rows_where("illegal")),
        "binding": binding_counts(found),
        "refusals": refusals(found),
        "pareto": fronts,
        "tasks": {"done": found.done, "taken_over": found.taken_over},
    }


def binding_counts(found: Exploration) -> dict[str, int]:
    """Return the number of designs that fail for each reason, the most frequent first."""
    pairs = zip(found.columns["status"], found.columns["binding"], strict=True)
    names = [b for s, b in pairs if s != "feasible"]
    return dict(sorted(((n, names.count(n)) for n in set(names)), key=lambda p: (-p[1], p[0])))


def refusals(found: Exploration) -> dict[str, int]:
    """Return why the spec refuses designs, the most frequent reasons first."""
    counts = Counter(r for r in found.columns["reason"] if r)
    return dict(sorted(counts.items(), key=lambda p: (-p[1], p[0]))[:MOST_REASONS])


def _report(found: Exploration) -> None:
    from gelslim_cad.explore.judge import REFUSED
    from gelslim_cad.explore.pareto import THICKNESS, TRADES, front
    from gelslim_cad.explore.space import shown

    rows = found.rows_where("feasible")
    resumed = f", {found.taken_over} tasks reused from before" if found.taken_over else ""
    say(f"{found.space.count} designs, {len(rows)} feasible{resumed}.")
    for name, count in binding_counts(found).items():
        if name == REFUSED:
            say(f"  {count:>6} refused by the spec")
            for reason, times in refusals(found).items():
                say(f"  {times:>10} {reason}")
        else:
            say(f"  {count:>6} stopped by {name}")
    if not rows:
        return
    best_designs = table("best feasible design", figures=("", "thickness"))
    best_designs.add_column("with")
    for goal in (THICKNESS, *(g for g in TRADES if g.name in found.columns)):
        x, y = ([found.columns[c][k] for k in rows] for c in (THICKNESS.name, goal.name))
        best = rows[front(goal.costs(y), x)[0]]
        chosen = (
            f"{a.path.removeprefix('design.')} {shown(found.columns[a.path][best])}"
            for a in found.space.axes
        )
        best_designs.add_row(
            f"{'most' if goal.better == 'more' else 'least'} {goal.words}",
            number(found.columns[goal.name][best], goal.unit),
            number(found.columns[THICKNESS.name][best], "mm"),
            ", ".join(chosen),
        )
    console().print(best_designs)
