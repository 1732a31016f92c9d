"""`gelslim bundle`: the stiffness bundle alone, with its measured ladder of operators."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim_cad.cli.budget import FieldError, FrameTime
from gelslim_cad.cli.options import AsJson, Force, SpecFile

if TYPE_CHECKING:
    from accuracy_budget.budget import Budget
    from ifem_export.operator_ladder import OperatorLadder


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
    from gelslim_cad.cli.answer import print_json
    from gelslim_cad.cli.budget import budget_of
    from gelslim_cad.cli.output import require_pad_rules, written
    from gelslim_cad.cli.progress import progress_bar
    from gelslim_cad.dimensions import derive
    from gelslim_cad.pad import gel_material, make_bundle, marker_grid, pad_mesh, reference_mesh
    from gelslim_cad.spec.reader import read_spec
    from ifem_export.bundle_io import write_bundle
    from ifem_export.ladder import measure_ladder

    budget = budget_of(error, within)
    loaded = read_spec(spec)
    d = derive(loaded.spec)
    require_pad_rules(d, "gelslim bundle", force)
    grid = marker_grid(d)
    mesh, _ = pad_mesh(d, grid)
    measured, label = None, ""
    if ladder or not budget.unlimited:
        gel, element = gel_material(loaded.spec), loaded.spec.mesh.element
        with progress_bar(quiet=as_json) as tell:
            measured = measure_ladder(
                mesh,
                gel,
                element,
                dense=dense,
                progress=tell,
                reference=reference_mesh(d, mesh),
            )
        label = chosen_label(measured, budget)
    folder = out or Path("out") / f"{loaded.spec.name}-bundle"
    made = make_bundle(
        loaded.spec, d, mesh, grid, with_stiffness=with_k, ladder=measured, operator=label
    )
    write_bundle(folder, made)
    files = sorted(p.name for p in folder.iterdir())
    elements, nodes = mesh.n_elements, mesh.n_nodes
    if as_json:
        print_json(
            {
                "folder": str(folder),
                "files": files,
                "elements": elements,
                "nodes": nodes,
                "markers": len(grid),
                "operator": label,
                "ladder": measured.to_record() if measured is not None else None,
            }
        )
        return 0
    if measured is not None:
        print_ladder(measured, label)
    print(f"{written(folder, files)}: {elements} elements, {nodes} nodes, {len(grid)} markers.")
    return 0


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

    from gelslim_cad.cli.answer import console

    table = Table("operator", "field error", "resultant", "per frame", "memory", "", box=None)
    for rung in ladder.rungs:
        table.add_row(
            rung.label,
            f"{rung.error_field:.2%}",
            f"{rung.error_resultant:.2%}",
            f"{rung.milliseconds:.3f} ms",
            f"{rung.n_bytes / 1e6:.1f} MB",
            "chosen" if rung.label == chosen else "",
        )
    console().print(table)
    print(f"Against {ladder.reference}; nu = {ladder.poissons_ratio:g}.")
