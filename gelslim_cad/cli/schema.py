"""`gelslim schema`: the JSON Schema of the spec."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def schema(
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Write to this file instead.")
    ] = None,
) -> int:
    """Print the JSON Schema of the spec.

    Editors check and complete the YAML by it.
    """
    from gelslim_cad.spec.schema import schema_text

    text = schema_text()
    if out is None:
        print(text, end="")
        return 0
    from gelslim_cad.cli.output import replace_file

    replace_file(out, text.encode())
    print(f"Wrote {out}. In VS Code, name it in the setting yaml.schemas.")
    return 0
