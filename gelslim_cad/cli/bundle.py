"""`gelslim bundle`: the stiffness bundle alone."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gelslim_cad.cli.options import AsJson, Force, SpecFile


def bundle(
    spec: SpecFile,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Folder; out/NAME-bundle if left out.")
    ] = None,
    force: Force = False,
    as_json: AsJson = False,
) -> int:
    """Write the stiffness bundle alone.

    Pad mesh, stiffness matrix, markers and camera, as `build` writes them.
    """
    from gelslim_cad.cli.answer import print_json
    from gelslim_cad.cli.output import require_pad_rules, written
    from gelslim_cad.dimensions import derive
    from gelslim_cad.pad import make_bundle, marker_grid, pad_mesh
    from gelslim_cad.spec.reader import read_spec
    from ifem_export.bundle_io import write_bundle

    loaded = read_spec(spec)
    d = derive(loaded.spec)
    require_pad_rules(d, "gelslim bundle", force)
    grid = marker_grid(d)
    mesh, _ = pad_mesh(d, grid)
    folder = out or Path("out") / f"{loaded.spec.name}-bundle"
    write_bundle(folder, make_bundle(loaded.spec, d, mesh, grid))
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
            }
        )
    else:
        print(f"{written(folder, files)}: {elements} elements, {nodes} nodes, {len(grid)} markers.")
    return 0
