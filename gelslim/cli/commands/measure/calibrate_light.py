"""`gelslim calibrate-light`: the light of a built sensor from presses of a ball."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim.cli.answer import console, say, table
from gelslim.cli.calibration_files import CalibrationFiles, tell
from gelslim.cli.options import AsJson, SensorBundle

if TYPE_CHECKING:
    from gelslim_force.joint.light.calibration import LightCalibration


def calibrate_light(
    bundle: SensorBundle,
    reference: Annotated[
        Path, typer.Argument(metavar="REFERENCE", help="Picture without contact.")
    ],
    presses: Annotated[
        Path,
        typer.Argument(metavar="PRESSES", help="Folder of pictures of the ball, about ten."),
    ],
    ball_mm: Annotated[float, typer.Option(help="Diameter of the ball in mm.")],
    fit_ball: Annotated[
        bool, typer.Option("--fit-ball", help="Find the diameter too, from the given one on.")
    ] = False,
    calibration: Annotated[
        Path | None,
        typer.Option(
            "-c",
            "--calibration",
            help="File of `gelslim calibrate`; by default the reference calibrates the camera.",
        ),
    ] = None,
    gel_calibration: Annotated[
        Path | None, typer.Option(help="File of `gelslim calibrate-gel`: the gel as built.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            help="File to write for `gelslim force --light-calibration`; by default none is "
            "written.",
        ),
    ] = None,
    report: Annotated[Path | None, typer.Option("--report", help="Report to write, .html.")] = None,
    as_json: AsJson = False,
) -> int:
    """Calibrate the light by presses of a ball at many places.

    The slope under a ball is known, so that each picture tells how much the light changes with the
    slope there. Prints the gain of each colour over the traced light and what it does not explain.
    Refuses presses of a ball of another size, and pictures whose light no ball explains. With -o it
    writes a file that `gelslim force --light-calibration` takes.
    """
    from gelslim_force.calibration.calibration import calibrate
    from gelslim_force.calibration.file import read_calibration
    from gelslim_force.calibration.reference_picture import read_reference
    from gelslim_force.joint.light.calibration import light_calibration_record
    from gelslim_force.presses.calibrate_light import calibrate_light as calibrated
    from gelslim_force.presses.gel_calibration import read_gel_calibration
    from gelslim_force.presses.light_report import light_report_html
    from gelslim_force.presses.press_pictures import picture_names, press_pictures
    from ifem_export.bundle.files import load_bundle

    files = CalibrationFiles("calibration of a light", b"gelslim-light-calibration/", out, report)
    sensor, rest = load_bundle(bundle), read_reference(reference)
    gel = None if gel_calibration is None else read_gel_calibration(gel_calibration)
    names = [
        name for name in picture_names(presses) if (presses / name).resolve() != reference.resolve()
    ]
    pictures = press_pictures(presses, names)
    camera = read_calibration(calibration) if calibration else calibrate(sensor, rest)
    found = calibrated(sensor, camera, rest, pictures, ball_mm, gel=gel, fit_ball=fit_ball)
    files.answer(
        light_calibration_record(found),
        lambda: _describe(found),
        page=lambda: light_report_html(found),
        as_json=as_json,
    )
    return 0


def _describe(found: LightCalibration) -> None:
    colours = found.presses[0]["channels"]
    shown = table(
        "press",
        figures=(
            "x mm",
            "y mm",
            "patch mm",
            *colours,
            *(f"{c} gain" for c in colours),
        ),
    )
    for press in found.presses:
        shown.add_row(
            str(press["picture"]),
            *(f"{v:+.1f}" for v in press["place_mm"]),
            f"{press['contact_mm']:.2f}",
            *(f"{v:.0%}" for v in press["explained"]),
            *(f"{v:.3f}" for v in press["gain_over_fit"]),
        )
    console().print(shown)
    say("Under each colour the share of its change that is explained; gain over that of the fit.")
    tell(found.diagnosis, found.warnings)
