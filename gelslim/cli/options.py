"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

SpecFile = Annotated[Path, typer.Argument(metavar="SPEC", help="The finger's YAML file.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the answer as JSON, for programs.")]
Force = Annotated[
    bool, typer.Option("--force", help="Write even if a rule on gel, mesh or markers fails.")
]
DrawPictures = Annotated[bool, typer.Option(help="Write pictures.")]
OverlayPictures = Annotated[
    int, typer.Option(min=0, help="Number of overlay pictures, spread over the run.")
]
MostFrames = Annotated[
    int | None, typer.Option("--frames", min=1, help="Stop after this number of frames.")
]
CameraResponse = Annotated[
    float | None,
    typer.Option(
        "--gamma",
        min=0.2,
        max=5.0,
        show_default="1.8",
        help="Response of the camera: grey = light^(1/gamma), 1 for a linear one.",
    ),
]
SensorBundle = Annotated[
    Path, typer.Argument(metavar="BUNDLE", help="Folder of the sensor's bundle.")
]


def out_folder(default: str, what: str = "Folder to write") -> Any:
    """Return the option `--out` of a command that writes to the folder `default` without it."""
    return typer.Option("-o", "--out", help=f"{what}; by default {default}.")
