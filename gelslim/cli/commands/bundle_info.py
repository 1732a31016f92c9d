"""`gelslim bundle-info`: content of a bundle, and whether it is valid."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gelslim.cli.options import AsJson


def bundle_info(
    path: Annotated[Path, typer.Argument(metavar="BUNDLE", help="Folder of the bundle.")],
    as_json: AsJson = False,
) -> int:
    """Describe a bundle and verify it.

    Prints mesh, material, markers and operators. Checks the hash of every file, all values, and
    the stored pair of displacement and force. The exit status is 2 if something is wrong.
    """
    from gelslim.cli.answer import BAD_INPUT, print_json
    from ifem_export.bundle.files import summarise_bundle

    found = summarise_bundle(path)
    if as_json:
        print_json(found)
    else:
        _describe(path, found)
    return 0 if found["verification"]["ok"] else BAD_INPUT


def _describe(path: Path, found: dict[str, Any]) -> None:
    from gelslim.cli.answer import say, shown_ms

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
    markers = found["markers"]
    print(f"  markers    {markers['count'] if markers else 'none'}")
    ladder = found.get("ladder") or {}
    for rung in ladder.get("rungs", ()):
        inside = ", ".join(f"{k} {v:g}" for k, v in rung["parameters"].items())
        label = f"{rung['rung']} ({inside})" if inside else rung["rung"]
        mark = ", chosen" if label == ladder.get("operator") else ""
        print(f"  operator   {label}: field error {rung['error_field']:.2%}, "
              f"{shown_ms(rung['milliseconds'])}{mark}")  # fmt: skip
    verdict = found["verification"]
    if verdict["ok"]:
        print("  verified   all hashes, values and the self-test pair")
    else:
        say(f"  NOT VALID  {verdict['file']}: {verdict['reason']}; {verdict['remedy']}")
