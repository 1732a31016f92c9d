"""`gelslim new`: a commented spec to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the finger.")],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File to write; NAME.yaml if left out.")
    ] = None,
    length: Annotated[float, typer.Option(help="Gel length along the finger, mm.")] = 24.0,
    width: Annotated[float, typer.Option(help="Gel width across the finger, mm.")] = 22.0,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file.")] = False,
) -> int:
    """Write a commented spec to start from.

    The Raspberry Pi spy camera is filled in and every default shown.
    """
    from gelslim.cli.failure import CommandError
    from gelslim.cli.output import replace_file
    from gelslim_cad.spec.starter import starter_text

    text = starter_text(name, gel_length_mm=length, gel_width_mm=width)
    target = out or Path(f"{name}.yaml")
    if target.is_dir():
        target = target / f"{name}.yaml"
    if target.exists() and not force:
        raise CommandError(
            f"gelslim new: {target} exists and is left as it is; give another -o, or --force"
        )
    replace_file(target, text.encode())
    print(f"Wrote {target}. Next: gelslim check {target}")
    return 0
