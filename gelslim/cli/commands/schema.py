"""`gelslim schema`: the JSON Schema of specs or scenes, or a reference page of it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gelslim.cli.output import replace_file, require_own_file


def schema(
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="Write to this file instead of standard output."),
    ] = None,
    scene: Annotated[
        bool, typer.Option("--scene", help="Print the schema of contact scenes instead of specs.")
    ] = False,
    markdown: Annotated[
        bool,
        typer.Option("--markdown", help="Print a page for reading, with every field in tables."),
    ] = False,
) -> int:
    """Print the JSON Schema of the spec.

    Editors use it to check and to complete the YAML.
    """
    text = _page(scene) if markdown else _schema(scene)
    if out is None:
        print(text, end="")
        return 0

    require_own_file(out, b"gelslim-", "schema of gelslim")
    replace_file(out, text.encode())
    use = "" if markdown else " In VS Code, name it in the setting yaml.schemas."
    print(f"Wrote {out}.{use}")
    return 0


def _schema(scene: bool) -> str:
    if scene:
        from gelslim_twin.scene.reader import scene_schema_text

        return scene_schema_text()
    from gelslim_cad.spec.reference import schema_text

    return schema_text()


def _page(scene: bool) -> str:
    if scene:
        from gelslim_twin.scene.reader import reference_text as scene_reference_text

        return scene_reference_text()
    from gelslim_cad.spec.reference import reference_text

    return reference_text()
