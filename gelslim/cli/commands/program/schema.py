"""`gelslim schema`: the JSON Schema of specs, scenes or sensors, or a reference page of it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gelslim.cli.failure import CommandError
from gelslim.cli.output import replace_file, require_own_file

SCHEMA_FILES = {False: "gelslim-spec-1.schema.json", True: "gelslim-scene-1.schema.json"}
"""Usual names of the files, by whether the schema is that of scenes."""


def schema(
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="Write to this file instead of standard output."),
    ] = None,
    scene: Annotated[
        bool, typer.Option("--scene", help="Print the schema of contact scenes instead of specs.")
    ] = False,
    sensor: Annotated[
        bool,
        typer.Option("--sensor", help="Print the schema of descriptions for import-sensor."),
    ] = False,
    markdown: Annotated[
        bool,
        typer.Option("--markdown", help="Print a page for reading, with every field in tables."),
    ] = False,
) -> int:
    """Print the JSON Schema of the spec.

    Editors use it to check and to complete the YAML.
    """
    if scene and sensor:
        raise CommandError("give --scene or --sensor, not both")
    text = _text(scene, sensor, markdown)
    if out is None:
        print(text, end="")
        return 0

    require_own_file(out, b"gelslim-", "schema of gelslim")
    replace_file(out, text.encode())
    line = f"# yaml-language-server: $schema={out.name}"
    use = "" if markdown else f' Name it in the first line of a file beside it: "{line}"'
    print(f"Wrote {out}.{use}")
    return 0


def _text(scene: bool, sensor: bool, markdown: bool) -> str:
    if not sensor:
        return _page(scene) if markdown else schema_text(scene)
    from gelslim_force.imported import starter

    return starter.reference_text() if markdown else starter.schema_text()


def schema_text(scene: bool) -> str:
    """The JSON Schema of specs, or of scenes."""
    if scene:
        from gelslim_twin.scene.reader import scene_schema_text

        return scene_schema_text()
    from gelslim_cad.spec.reference import schema_text as spec_schema_text

    return spec_schema_text()


def _page(scene: bool) -> str:
    if scene:
        from gelslim_twin.scene.reader import reference_text as scene_reference_text

        return scene_reference_text()
    from gelslim_cad.spec.reference import reference_text

    return reference_text()
