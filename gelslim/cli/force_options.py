"""Arguments and options of `gelslim force`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Frames = Annotated[
    str,
    typer.Argument(
        metavar="FRAMES", help="Folder of pictures, video, .npy array, or camera:0 for live."
    ),
]
Reference = Annotated[
    Path | None, typer.Option("-r", "--reference", help="Picture without contact.")
]
Calibration = Annotated[
    Path | None,
    typer.Option("-c", "--calibration", help="File of `gelslim calibrate`, in its place."),
]
RunFolder = Annotated[
    Path | None, typer.Option("-o", "--out", help="Run folder; out/NAME-force if left out.")
]
KnownIndenter = Annotated[
    str | None,
    typer.Option(help="Known indenter: sphere:10, cylinder:6, flat:5, flat:4x8 (mm)."),
]
KnownDepth = Annotated[
    float | None, typer.Option(min=0, help="Known depth of the indenter; a flat one needs it.")
]
DepthMaps = Annotated[
    Path | None,
    typer.Option(help=".npy of heights (frames, h, w) in mm, registered to the pictures."),
]
OperatorName = Annotated[str | None, typer.Option(help="Operator by name, such as fft.")]
Method = Annotated[str, typer.Option(help="auto, direct, low_pass or masked; see the guide.")]
Compensation = Annotated[str, typer.Option(help="Projection: exact, arctan, printed or none.")]
Interpolation = Annotated[str, typer.Option(help="sparse or thin_plate.")]
GelLaw = Annotated[str, typer.Option(help="linear or neo_hookean.")]
Friction = Annotated[float, typer.Option(min=0, help="Coulomb coefficient.")]
FieldFormat = Annotated[str, typer.Option(help="Force fields as npz, parquet or none.")]
OverlayVideo = Annotated[Path | None, typer.Option(help="Overlay video, .mp4 or .avi.")]
Recording = Annotated[Path | None, typer.Option(help="Recording with ROS 2 messages.")]
LiveView = Annotated[bool, typer.Option("--view", help="Watch in a browser meanwhile.")]
ReplaceRun = Annotated[bool, typer.Option("--force", help="Replace an earlier run.")]
