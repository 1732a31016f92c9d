"""`gelslim bundle`, `bundle-info` and `bundle-export`: make, describe and export a bundle."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import BAD_INPUT, console, print_json, progress_bar, say, shown_ms, table
from gelslim.cli.budget import FieldError, FrameTime, budget_of
from gelslim.cli.failure import CommandError
from gelslim.cli.options import AsJson, Force, SpecFile, out_folder
from gelslim.cli.output import require_own_file, require_pad_rules, written
from gelslim_core.budget.budget import shown_share

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle
    from ifem_export.operators.operator_ladder import OperatorLadder


BundleFolder = Annotated[Path, typer.Argument(metavar="BUNDLE", help="Folder of the bundle.")]
MARKS = {
    ".mtx": b"K in N/mm of geometry",
    ".mat": b"gelslim-bundle",
    ".safetensors": b"gelslim-bundle/",
    ".npz": b"surface_",
    ".inp": b"Gel pad of geometry",
    ".msh": b'"GEL"',
}
"""Text near the beginning of each kind of export, by which an export is recognised."""
_KINDS = {
    "smooth": ("smooth",),
    "balls": ("small_ball", "two_contacts"),
    "punch": ("sharp_punch",),
    "edge": ("edge",),
}
"""Columns of the table of operators, with the motions whose largest error they show."""


def bundle(
    spec: SpecFile,
    out: Annotated[Path | None, out_folder("out/NAME-bundle")] = None,
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
    from gelslim.design import derive, make_bundle
    from gelslim_cad.tolerance.asked import read_spec
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
    rows = table("operator", *_KINDS, "per frame", "memory", "", pad_edge=True)
    for rung in ladder.rungs:
        errors = rung.errors
        by_kind = [[errors[k] for k in kinds if k in errors] for kinds in _KINDS.values()]
        rows.add_row(
            rung.label,
            *(f"{100 * max(found):.3g}%" if found else "" for found in by_kind),
            shown_ms(rung.milliseconds),
            f"{rung.n_bytes / 1e6:.1f} MB",
            "chosen" if rung.label == chosen else "",
        )
    console().print(rows)
    exact = max(rung.worst_resultant for rung in ladder.rungs if rung.rung != "paper")
    print(
        "The errors are the larger ones of field and resultant, for smooth motions and small, "
        f"sharp and edge contacts, against {ladder.reference}; nu = {ladder.poissons_ratio:g}. "
        f"The resultant alone is within {shown_share(exact)}, but for `paper`."
    )


def bundle_info(
    path: BundleFolder,
    as_json: AsJson = False,
) -> int:
    """Describe a bundle and verify it.

    Prints mesh, material, markers and operators. Checks the hash of every file, all values, and
    the stored pair of displacement and force. The exit status is 2 if something is wrong.
    """
    from ifem_export.bundle.files import summarise_bundle

    found = summarise_bundle(path)
    if as_json:
        print_json(found)
    else:
        _describe(path, found)
    return 0 if found["verification"]["ok"] else BAD_INPUT


def _describe(path: Path, found: dict[str, Any]) -> None:
    mesh, material = found["mesh"], found["material"]
    cells = " x ".join(str(c) for c in mesh["cells"])
    size = " x ".join(f"{h:.4g}" for h in mesh["cell_size_mm"])
    stored = f"stored, {found['stiffness']['nonzeros']} entries"
    print(f"{path}: {found['format']}, {found['total_bytes'] / 1e6:.2f} MB")
    print(f"  sensor     spec {found['spec_hash'][:12]}, geometry {found['geometry_hash'][:12]}")
    print(f"  mesh       {cells} cells of {size} mm: {mesh['elements']} elements, "
          f"{mesh['nodes']} nodes, {mesh['surface_nodes']} on the surface")  # fmt: skip
    print(f"  element    {found['element']['type']} {found['element']['formulation']}")
    print(f"  gel        E = {material['youngs_modulus_mpa']:g} MPa, "
          f"nu = {material['poissons_ratio']:g}")  # fmt: skip
    print(f"  stiffness  {stored if found['stiffness']['stored'] else 'assembled when needed'}")
    adjoint = "stored" if found.get("adjoint") else "computed when needed (older bundle)"
    print(f"  adjoint    fields of force and torque {adjoint}")
    markers = found["markers"]
    print(f"  markers    {markers['count'] if markers else 'none'}")
    ladder = found.get("ladder") or {}
    for rung in ladder.get("rungs", ()):
        inside = ", ".join(f"{k} {v:g}" for k, v in rung["parameters"].items())
        label = f"{rung['rung']} ({inside})" if inside else rung["rung"]
        mark = ", chosen" if label == ladder.get("operator") else ""
        print(f"  operator   {label}: {_shown_errors(rung)}, "
              f"{shown_ms(rung['milliseconds'])}{mark}")  # fmt: skip
    for kind in ("given", "measured", "assumed", "missing"):
        for line in (found.get("imported") or {}).get(kind, ()):
            say(f"  {kind:<10} {line}")
    verdict = found["verification"]
    if verdict["ok"]:
        print("  verified   all hashes, values and the self-test pair")
    else:
        say(f"  NOT VALID  {verdict['file']}: {verdict['reason']}; {verdict['remedy']}")


def _shown_errors(record: Mapping[str, Any]) -> str:
    """Error for smooth motions and the worst one, of a rung as it is stored."""
    from ifem_export.operators.operator_ladder import MeasuredRung

    rung = MeasuredRung.from_record(record)
    return (
        f"error {shown_share(rung.errors['smooth'])} of smooth motions, {shown_share(rung.error)} "
        "at worst"
    )


def bundle_export(
    path: BundleFolder,
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="File to write; its ending chooses the format."),
    ],
    matrix: Annotated[
        str | None,
        typer.Option(
            "--matrix",
            help="Matrix of the outer surface alone, surface_stiffness or surface_compliance "
            "(.npz, .mat).",
        ),
    ] = None,
    element: Annotated[
        str | None,
        typer.Option(
            "--element",
            help="C3D8, C3D8I, C3D20 or C3D20R (.inp, .msh); by default as in the bundle.",
        ),
    ] = None,
    law: Annotated[
        str | None, typer.Option("--law", help="Material of a .inp: linear or neo_hookean.")
    ] = None,
) -> int:
    """Write mesh or stiffness of a bundle for other programs.

    Stiffness matrix of the whole pad: Matrix Market (.mtx), MATLAB (.mat, indices from 1),
    safetensors. Dense matrix of its surface with --matrix: NumPy (.npz), MATLAB (.mat). Mesh with
    sets and material: Abaqus and CalculiX (.inp), gmsh (.msh). The bundle is verified first.
    """
    from ifem_export.bundle.files import load_bundle
    from ifem_export.exports.export import export_bundle, export_options

    options = export_options(file, matrix=matrix, element=element, law=law)
    require_own_file(file, MARKS[file.suffix], "export of a bundle")
    export_bundle(load_bundle(path), file, options)
    print(f"Wrote {file} ({file.stat().st_size / 1e6:.2f} MB)")
    return 0
