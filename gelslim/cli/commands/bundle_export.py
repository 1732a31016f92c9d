"""`gelslim bundle-export`: the stiffness matrix of a bundle for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

MARKS = {
    ".mtx": b"K in N/mm of geometry",
    ".mat": b"gelslim-bundle",
    ".safetensors": b"gelslim-bundle/",
}


def bundle_export(
    path: Annotated[Path, typer.Argument(metavar="BUNDLE", help="Folder of the bundle.")],
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="File to write: NAME.mtx, NAME.mat or NAME.safetensors."
        ),
    ],
) -> int:
    """Write the stiffness matrix of a bundle for other programs.

    The ending of the file chooses the format: Matrix Market (.mtx), MATLAB (.mat, indices from 1)
    or safetensors. The bundle is verified first.
    """
    from gelslim.cli.answer import BAD_INPUT
    from gelslim.cli.failure import CommandError
    from gelslim.cli.output import spare_strangers
    from ifem_export.bundle.export_matrix import EXPORTS, export_matrix
    from ifem_export.bundle.files import load_bundle

    if file.suffix not in EXPORTS:
        raise CommandError(
            f"{file}: the ending {file.suffix!r} names no format; use {', '.join(EXPORTS)}",
            BAD_INPUT,
        )
    # Each kind of file names its origin near its beginning.
    spare_strangers(file, MARKS[file.suffix], "export of a bundle")
    export_matrix(load_bundle(path), file)
    print(f"Wrote {file} ({file.stat().st_size / 1e6:.2f} MB)")
    return 0
