"""`gelslim bundle-export`: a bundle's stiffness matrix for other programs."""

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
    path: Annotated[Path, typer.Argument(metavar="BUNDLE", help="The bundle.")],
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="NAME.mtx, NAME.mat or NAME.safetensors.")
    ],
) -> int:
    """Write a bundle's stiffness matrix for other programs.

    The ending chooses the format: Matrix Market (.mtx), MATLAB (.mat, counting from 1) or
    safetensors. The bundle is verified first.
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
    # Each kind of file says where it comes from in its head.
    spare_strangers(file, MARKS[file.suffix], "export of a bundle")
    export_matrix(load_bundle(path), file)
    print(f"Wrote {file} ({file.stat().st_size / 1e6:.2f} MB)")
    return 0
