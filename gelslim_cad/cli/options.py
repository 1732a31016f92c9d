"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

SpecFile = Annotated[Path, typer.Argument(metavar="SPEC", help="The finger's YAML file.")]
AsJson = Annotated[bool, typer.Option("--json", help="Answer in JSON, for programs.")]
Force = Annotated[
    bool, typer.Option("--force", help="Write even where a rule on gel, mesh or markers fails.")
]
