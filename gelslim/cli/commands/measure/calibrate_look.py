"""`gelslim calibrate-look`: the look of a built sensor, for pictures drawn like its own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gelslim.cli.calibration_files import CalibrationFiles, tell
from gelslim.cli.options import AsJson, SensorBundle


def calibrate_look(
    bundle: SensorBundle,
    rest: Annotated[Path, typer.Argument(metavar="REST", help="Picture without contact.")],
    presses: Annotated[
        Path | None,
        typer.Argument(
            metavar="[PRESSES]",
            help="Folder of pictures with contacts, about ten: they tell noise from texture, and "
            "drawn pictures are compared with them.",
        ),
    ] = None,
    gamma: Annotated[
        float,
        typer.Option(min=0.2, max=5.0, help="Response of the camera: grey = light^(1/gamma)."),
    ] = 1.8,
    calibration: Annotated[
        Path | None,
        typer.Option(
            "-c",
            "--calibration",
            help="File of `gelslim calibrate`; by default REST calibrates the camera.",
        ),
    ] = None,
    light_calibration: Annotated[
        Path | None,
        typer.Option(help="File of `gelslim calibrate-light`: the shading as built."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            help="File to write for `look:` of a scene; by default none is written.",
        ),
    ] = None,
    report: Annotated[Path | None, typer.Option("--report", help="Report to write, .html.")] = None,
    as_json: AsJson = False,
) -> int:
    """Fit what a drawn picture needs to look like those of a built sensor.

    Found are the light of each colour over the gel, the contrast of the ink and the size of each
    dot, the point spread, the noise and its spectrum, and what else the picture shows: texture,
    reflections, walls. With -o it writes a file that a scene takes as `look`.
    """
    from gelslim_force.calibration.calibration import calibrate
    from gelslim_force.calibration.file import read_calibration
    from gelslim_force.calibration.reference_picture import read_reference
    from gelslim_force.joint.light.calibration import read_light_calibration
    from gelslim_force.presses.press_pictures import picture_names, press_pictures
    from gelslim_twin.appearance.calibrate_look import calibrate_look as calibrated
    from gelslim_twin.appearance.look_report import look_report_html
    from gelslim_twin.scene.built_look import look_record
    from gelslim_twin.simulation.sensor import TwinSensor
    from ifem_export.bundle.files import load_bundle

    files = CalibrationFiles("look of a sensor", b"gelslim-look/", out, report)
    sensor, reference = load_bundle(bundle), read_reference(rest)
    names = [
        name
        for name in (picture_names(presses) if presses else ())
        if presses and (presses / name).resolve() != rest.resolve()
    ]
    found = calibrated(
        sensor,
        read_calibration(calibration) if calibration else calibrate(sensor, reference),
        reference,
        TwinSensor(sensor).light(),
        press_pictures(presses, names) if presses else {},
        gamma=gamma,
        light_calibration=None
        if light_calibration is None
        else read_light_calibration(light_calibration),
    )
    look = found.look
    files.answer(
        look_record(look),
        lambda: tell(look.diagnosis, look.warnings),
        page=lambda: look_report_html(found),
        as_json=as_json,
        more={"gel": look.judged.get("gel")},
    )
    return 0
