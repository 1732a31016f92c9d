"""`gelslim bundle`: the stiffness bundle alone, with its measured ladder of operators."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.budget import FieldError, FrameTime
from gelslim.cli.options import AsJson, Force, SpecFile

if TYPE_CHECKING:
    from gelslim_cad.dimensions import Dimensions
    from gelslim_cad.spec import Spec
    from gelslim_core.budget.budget import Budget
    from ifem_export.bundle.bundle import Bundle
    from ifem_export.mesh.pad_mesh import PadMesh
    from ifem_export.operators.operator_ladder import OperatorLadder


def bundle(
    spec: SpecFile,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Folder; out/NAME-bundle if left out.")
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
        bool, typer.Option("--with-k", help="Store the stiffness matrix, not its recipe alone.")
    ] = False,
    force: Force = False,
    as_json: AsJson = False,
) -> int:
    """Write the stiffness bundle alone.

    Pad mesh, element recipe, markers, camera, and the ladder of surface operators with the error
    and time measured for this sensor. A budget chooses the operator that the pipeline starts with.
    """
    from gelslim.cli.answer import print_json
    from gelslim.cli.budget import budget_of
    from gelslim.cli.failure import CommandError
    from gelslim.cli.output import require_pad_rules, written
    from gelslim_cad.dimensions import derive
    from gelslim_cad.sensor.pad import make_bundle, marker_grid, pad_mesh
    from gelslim_cad.spec.reader import read_spec
    from ifem_export.bundle.files import write_bundle

    budget = budget_of(error, within)
    if not (ladder or budget.unlimited):
        raise CommandError("--no-ladder leaves a budget nothing to choose from: give one of them")
    loaded = read_spec(spec).spec
    d = derive(loaded)
    require_pad_rules(d, "gelslim bundle", force)
    grid = marker_grid(d)
    mesh, _ = pad_mesh(d, grid)
    measured, label = None, ""
    if ladder:
        measured = _measured(loaded, d, mesh, dense, quiet=as_json)
        label = chosen_label(measured, budget)
    folder = out or Path("out") / f"{loaded.name}-bundle"
    made = make_bundle(
        loaded, d, mesh, grid, with_stiffness=with_k, ladder=measured, operator=label
    )
    write_bundle(folder, made)
    files = sorted(p.name for p in folder.iterdir())
    if as_json:
        print_json({"folder": str(folder), "files": files, **_record(made, len(grid))})
        return 0
    if measured is not None:
        print_ladder(measured, label)
    counts = f"{mesh.n_elements} elements, {mesh.n_nodes} nodes, {len(grid)} markers"
    print(f"{written(folder, files)}: {counts}.")
    return 0


def _measured(
    spec: Spec, d: Dimensions, mesh: PadMesh, dense: bool, *, quiet: bool
) -> OperatorLadder:
    """Error and time of every operator on this pad, with or without the dense one."""
    from gelslim.cli.progress import progress_bar
    from gelslim_cad.sensor.pad import gel_material, reference_mesh
    from ifem_export.operators.ladder import measure_ladder

    gel, element, fine = gel_material(spec), spec.mesh.element, reference_mesh(d, mesh)
    with progress_bar(quiet=quiet) as tell:
        return measure_ladder(mesh, gel, element, dense=dense, progress=tell, reference=fine)


def _record(made: Bundle, markers: int) -> dict[str, Any]:
    return {
        "elements": made.mesh.n_elements,
        "nodes": made.mesh.n_nodes,
        "markers": markers,
        "operator": made.operator,
        "ladder": made.ladder.to_record() if made.ladder is not None else None,
    }


def chosen_label(ladder: OperatorLadder, budget: Budget) -> str:
    """Label of the operator that a budget picks, else of the one a bundle starts with.

    The ladder was measured here and now, so that its times are this machine's. Raises BudgetError.
    """
    if budget.unlimited:
        return ladder.balanced().label
    choice = ladder.choose(budget)
    for remark in choice.remarks:
        print(f"gelslim: {remark}", file=sys.stderr)
    return choice.rung.name


def print_ladder(ladder: OperatorLadder, chosen: str) -> None:
    """A table of the rungs, the chosen one marked."""
    from rich.table import Table

    from gelslim.cli.answer import console

    columns = ("operator", "field error", "at the edge", "resultant", "per frame", "memory", "")
    table = Table(*columns, box=None)
    for rung in ladder.rungs:
        table.add_row(
            rung.label,
            f"{rung.error_field:.2%}",
            "" if rung.error_edge is None else f"{rung.error_edge:.2%}",
            f"{rung.error_resultant:.2%}",
            f"{rung.milliseconds:.3f} ms",
            f"{rung.n_bytes / 1e6:.1f} MB",
            "chosen" if rung.label == chosen else "",
        )
    console().print(table)
    print(f"Errors against {ladder.reference}; nu = {ladder.poissons_ratio:g}.")
