"""`gelslim bundle`: the stiffness bundle alone, with its measured ladder of operators."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim_cad.cli.options import AsJson, Force, SpecFile

if TYPE_CHECKING:
    from ifem_export.ladder import Ladder


def bundle(
    spec: SpecFile,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Folder; out/NAME-bundle if left out.")
    ] = None,
    error: Annotated[
        str | None,
        typer.Option(help="Field error that the chosen operator may have, as 3% or 0.03."),
    ] = None,
    time_ms: Annotated[
        float | None, typer.Option(min=0, help="Time per frame that it may take, in ms.")
    ] = None,
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
    from gelslim_cad.cli.output import require_pad_rules, written
    from gelslim_cad.cli.progress import progress_bar
    from gelslim_cad.dimensions import derive
    from gelslim_cad.pad import gel_material, make_bundle, marker_grid, pad_mesh, reference_mesh
    from gelslim_cad.spec.reader import read_spec
    from ifem_export.bundle_io import write_bundle
    from ifem_export.ladder import chosen_rung, measure_ladder

    allowed = None if error is None else share(error)
    loaded = read_spec(spec)
    d = derive(loaded.spec)
    require_pad_rules(d, "gelslim bundle", force)
    grid = marker_grid(d)
    mesh, _ = pad_mesh(d, grid)
    measured, chosen = None, None
    if ladder or allowed is not None or time_ms is not None:
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
        chosen = chosen_rung(measured, measured.balanced().label, allowed, time_ms)
    label = chosen.label if chosen is not None else ""
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


def print_ladder(ladder: Ladder, chosen: str) -> None:
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


def share(text: str) -> float:
    """3% or 0.03 as 0.03; raises CommandError for anything else."""
    from gelslim_cad.cli.failure import CommandError
    from gelslim_cad.cli.status import BAD_INPUT

    number = text.strip().removesuffix("%")
    try:
        value = float(number) / (100 if number != text.strip() else 1)
    except ValueError:
        value = float("nan")
    if not 0 < value < 100:
        raise CommandError(f"--error {text!r}: must be a share above 0, as 3% or 0.03", BAD_INPUT)
    return value
