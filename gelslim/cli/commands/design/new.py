"""`gelslim new` and `gelslim examples`: a spec or a scene to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gelslim.cli.answer import console, print_json, table
from gelslim.cli.commands.program.schema import SCHEMA_FILES, schema_text
from gelslim.cli.failure import CommandError
from gelslim.cli.options import AsJson
from gelslim.cli.output import replace_file, require_own_file


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the finger.")],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="File to write; by default NAME.yaml.")
    ] = None,
    source: Annotated[
        str,
        typer.Option("--from", help="Copy this example; `gelslim examples` lists them."),
    ] = "",
    camera: Annotated[
        str,
        typer.Option(help="Camera of the library; `gelslim cameras` lists them."),
    ] = "",
    gripper: Annotated[
        str,
        typer.Option(help="Gripper of the library; `gelslim grippers` lists them."),
    ] = "",
    length: Annotated[float, typer.Option(help="Length of the gel along the finger in mm.")] = 24.0,
    width: Annotated[float, typer.Option(help="Width of the gel across the finger in mm.")] = 22.0,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file.")] = False,
) -> int:
    """Write a commented spec to start from, or copy an example.

    A new spec has the data of the Raspberry Pi spy camera, or takes the --camera named, and shows
    every other field with its default. --gripper drills the flange for a gripper. With --from, a
    design or a scene that comes with the program is copied under the new name. The JSON Schema is
    written beside it, for editors that know the YAML language server: they then complete fields and
    mark errors.
    """
    if camera and source:
        raise CommandError("gelslim new: give --camera or --from, not both")
    if gripper and source:
        raise CommandError("gelslim new: give --gripper or --from, not both")
    target = out or Path(f"{name}.yaml")
    if target.is_dir():
        target = target / f"{name}.yaml"
    texts, following = _texts(name, source, (camera, gripper), (length, width))
    files = {target: texts.pop(f"{name}.yaml")}
    files |= {target.parent / other: text for other, text in texts.items()}
    scene = following == "plan"
    schema = target.parent / SCHEMA_FILES[scene]
    require_own_file(schema, b"gelslim-", "schema of gelslim")
    files[target] = f"# yaml-language-server: $schema={schema.name}\n{files[target]}"
    for path, text in files.items():
        same = path != target and path.is_file() and path.read_text(encoding="utf-8") == text
        if path.exists() and not (force or same):
            raise CommandError(
                f"gelslim new: {path} exists and was not changed; give another -o, or --force"
            )
    for path, text in files.items():
        replace_file(path, text.encode())
    replace_file(schema, schema_text(scene).encode())
    others = "".join(f" and {path.name}" for path in files if path != target)
    print(f"Wrote {target}{others}. Next: gelslim {following} {target}")
    return 0


def _texts(
    name: str, source: str, library: tuple[str, str], size_mm: tuple[float, float]
) -> tuple[dict[str, str], str]:
    """Return the texts by file name, and the command to use on the first file.

    `library` names a camera and a gripper, empty for none; `size_mm` is that of the gel.
    """
    from gelslim_cad.spec.starter import require_name, starter_text

    if not source:
        text = starter_text(name, *size_mm, model=library[0], gripper=library[1])
        return {f"{name}.yaml": text}, "check"
    from gelslim.examples import example

    require_name(name)
    found = example(source)
    return found.files(name), "check" if found.kind == "design" else "plan"


def examples(as_json: AsJson = False) -> int:
    """List the designs and scenes that come with the program.

    `gelslim new --from NAME MINE` copies one of them.
    """
    from gelslim.examples import examples as listed

    found = listed()
    if as_json:
        print_json(
            [
                {"name": e.name, "kind": e.kind, "path": str(e.path), "summary": e.summary}
                for e in found
            ]
        )
        return 0
    rows = table("name", "kind", "summary", padding=(0, 2, 0, 0))
    for entry in found:
        rows.add_row(entry.name, entry.kind, entry.summary)
    console().print(rows)
    return 0
