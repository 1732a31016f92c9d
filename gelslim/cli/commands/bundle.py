"""`gelslim bundle`: the bundle of a sensor alone, with its measured ladder of operators."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.budget import FieldError, FrameTime
from gelslim.cli.options import AsJson, Force, SpecFile

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle
    from ifem_export.operators.operator_ladder import OperatorLadder


def bundle(
    spec: SpecFile,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="Folder to write; by default out/NAME-bundle."),
    ] = None,
    error: FieldError = None,
    within: FrameTime = None,
    ladder: Annotated[
        bool, typer.Option(help="Measure error and time of every operator (some seconds).")
    ] = True,
    dense: Annotated[
        bool, typer.Option("--dense", help="Measure the dense operator too (up to a minute).")
    ] = False,
    with_k: Annotated[
        bool,
        typer.Option(
            "--with-k", help="Also store the stiffness matrix, which is otherwise assembled."
        ),
    ] = False,
    force: Force = False,
    as_json: AsJson = False,
) -> int:
    """Write the bundle of a sensor alone, without CAD.

    The bundle holds the mesh of the pad, its stiffness, markers, camera and light, and the ladder
    of force operators with error and time measured for this sensor. A budget (--error, --time)
    chooses the operator that the force pipeline starts with.
    """
    from gelslim.cli.answer import print_json, progress_bar
    from gelslim.cli.budget import budget_of
    from gelslim.cli.failure import CommandError
    from gelslim.cli.output import require_pad_rules, written
    from gelslim.design import derive, make_bundle
    from gelslim_cad.spec.reader import read_spec
    from ifem_export.bundle.files import write_bundle

    budget = budget_of(error, within)
    if not (ladder or budget.unlimited):
        raise CommandError(
            "--no-ladder and a budget exclude each other, because a budget chooses from the ladder"
        )
    loaded = read_spec(spec).spec
    require_pad_rules(derive(loaded), "gelslim bundle", force)
    with progress_bar(quiet=as_json) as tell:
        made = make_bundle(
            loaded, budget, measure=ladder, dense=dense, with_stiffness=with_k, progress=tell
        )
    for remark in made.remarks:
        print(f"gelslim: {remark}", file=sys.stderr)
    folder = out or Path("out") / f"{loaded.name}-bundle"
    write_bundle(folder, made.bundle)
    files = sorted(p.name for p in folder.iterdir())
    markers = 0 if made.bundle.markers is None else len(made.bundle.markers.positions_mm)
    if as_json:
        print_json({"folder": str(folder), "files": files, **_record(made.bundle, markers)})
        return 0
    if made.ladder is not None:
        print_ladder(made.ladder, made.operator)
    mesh = made.bundle.mesh
    counts = f"{mesh.n_elements} elements, {mesh.n_nodes} nodes, {markers} markers"
    print(f"{written(folder, files)}: {counts}.")
    return 0


def _record(made: Bundle, markers: int) -> dict[str, Any]:
    return {
        "elements": made.mesh.n_elements,
        "nodes": made.mesh.n_nodes,
        "markers": markers,
        "operator": made.operator,
        "ladder": made.ladder.to_record() if made.ladder is not None else None,
    }


def print_ladder(ladder: OperatorLadder, chosen: str) -> None:
    """Print a table of the rungs with a mark at the chosen one."""
    from rich.table import Table

    from gelslim.cli.answer import console, shown_ms

    columns = ("operator", "field error", "at the edge", "resultant", "per frame", "memory", "")
    table = Table(*columns, box=None)
    for rung in ladder.rungs:
        table.add_row(
            rung.label,
            f"{rung.error_field:.2%}",
            "" if rung.error_edge is None else f"{rung.error_edge:.2%}",
            f"{rung.error_resultant:.2%}",
            shown_ms(rung.milliseconds),
            f"{rung.n_bytes / 1e6:.1f} MB",
            "chosen" if rung.label == chosen else "",
        )
    console().print(table)
    print(f"The errors are against {ladder.reference}; nu = {ladder.poissons_ratio:g}.")
