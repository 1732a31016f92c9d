"""`gelslim calibrate-gel`: the gel of a built sensor from a ball under known weights."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim.cli.answer import console, say, table
from gelslim.cli.calibration_files import CalibrationFiles, tell
from gelslim.cli.options import AsJson, SensorBundle

if TYPE_CHECKING:
    from gelslim_force.presses.gel_calibration import GelCalibration


def calibrate_gel(
    bundle: SensorBundle,
    presses: Annotated[
        Path, typer.Argument(metavar="PRESSES", help="Folder of the pictures, one for each press.")
    ],
    loads: Annotated[
        Path,
        typer.Argument(
            metavar="LOADS",
            help="CSV file whose first line is `picture,load_g` or `picture,load_n`; a load of 0 "
            "marks a picture without contact.",
        ),
    ],
    ball_mm: Annotated[float, typer.Option(help="Diameter of the ball in mm.")],
    reference: Annotated[
        Path | None,
        typer.Option(
            "-r",
            "--reference",
            help="Picture without contact; by default the first of load 0, or else the first "
            "that is not in the table.",
        ),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            "-c",
            "--calibration",
            help="File of `gelslim calibrate`; by default the reference calibrates the camera.",
        ),
    ] = None,
    fit_ratio: Annotated[
        bool, typer.Option("--fit-ratio", help="Also fit Poisson's ratio.")
    ] = False,
    fit_skin: Annotated[
        bool,
        typer.Option(
            "--fit-skin", help="Also fit the membrane stiffness of the gel's coat and fabric."
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            help="File to write for `gelslim force --gel-calibration`; by default none is written.",
        ),
    ] = None,
    report: Annotated[Path | None, typer.Option("--report", help="Report to write, .html.")] = None,
    as_json: AsJson = False,
) -> int:
    """Calibrate the gel by presses of a ball under known weights.

    The size of the contact patch, the motion of the markers and the weight together give Young's
    modulus and the thickness of the gel with their covariance. Three presses are the least, five
    of different weight are better. With --fit-skin they also give the stiffness of a coat or a
    fabric on the gel; without it a warning tells where the presses contradict the design's. Prints
    the residual force of each press and what it does over time. With -o it writes a file that
    `gelslim force --gel-calibration` takes, which then uses the gel as built and adds its
    uncertainty to the standard deviations.
    """
    from gelslim_force.calibration.calibration import calibrate
    from gelslim_force.calibration.file import read_calibration
    from gelslim_force.presses.calibrate_gel import calibrate_gel as calibrated
    from gelslim_force.presses.gel_calibration import gel_calibration_record
    from gelslim_force.presses.gel_report import gel_report_html
    from gelslim_force.presses.load_table import read_loads
    from gelslim_force.presses.press_pictures import press_pictures, reference_of
    from ifem_export.bundle.files import load_bundle

    files = CalibrationFiles("calibration of a gel", b"gelslim-gel-calibration/", out, report)
    listed = read_loads(loads)
    rest, rest_name = reference_of(presses, listed, reference)
    pictures = press_pictures(presses, [load.picture for load in listed])
    sensor = load_bundle(bundle)
    camera = read_calibration(calibration) if calibration else calibrate(sensor, rest)
    found = calibrated(
        sensor, camera, rest, pictures, listed, ball_mm, fit_ratio=fit_ratio, fit_skin=fit_skin
    )
    files.answer(
        gel_calibration_record(found),
        lambda: _describe(found, rest_name),
        page=lambda: gel_report_html(found),
        as_json=as_json,
        more={"reference": rest_name},
    )
    return 0


def _describe(found: GelCalibration, reference: str) -> None:
    say(f"Reference: {reference}.")
    shown = table(
        "press",
        figures=("load N", "fitted N", "residual", "patch mm", "depth mm", "px"),
    )
    for press in found.presses:
        shown.add_row(
            str(press["picture"]),
            f"{press['load_n']:.3f}",
            f"{press['force_n']:.3f}",
            f"{press['residual_share']:+.1%}",
            f"{press['contact_mm']:.2f}",
            f"{press['depth_mm']:.3f}",
            f"{press['marker_rms_px']:.3f}",
        )
    console().print(shown)
    tell(found.diagnosis, found.warnings)
