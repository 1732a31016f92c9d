"""`gelslim force`: marker frames to forces."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim_cad.cli.budget import FieldError, FrameTime
from gelslim_cad.cli.options import AsJson

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from accuracy_budget.budget import Budget
    from gelslim_force.force_pipeline import ForcePipeline, NormalSource
    from gelslim_force.sensor_calibration import SensorCalibration
    from ifem_export.bundle import Bundle


def force(
    bundle: Annotated[Path, typer.Argument(metavar="BUNDLE", help="The sensor's bundle.")],
    frames: Annotated[
        str,
        typer.Argument(
            metavar="FRAMES", help="Folder of pictures, video, .npy array, or camera:0 for live."
        ),
    ],
    reference: Annotated[
        Path | None,
        typer.Option("-r", "--reference", help="Picture without contact."),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option("-c", "--calibration", help="File of `gelslim calibrate`, in its place."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Run folder; out/NAME-force if left out.")
    ] = None,
    indenter: Annotated[
        str | None,
        typer.Option(help="Known indenter: sphere:10, cylinder:6, flat:5, flat:4x8 (mm)."),
    ] = None,
    depth_mm: Annotated[
        float | None, typer.Option(min=0, help="Known depth of the indenter; a flat one needs it.")
    ] = None,
    depth_maps: Annotated[
        Path | None,
        typer.Option(help=".npy of heights (frames, h, w) in mm, registered to the pictures."),
    ] = None,
    error: FieldError = None,
    within: FrameTime = None,
    operator: Annotated[str | None, typer.Option(help="Operator by name, such as fft.")] = None,
    method: Annotated[
        str, typer.Option(help="auto, direct, low_pass or masked; see the guide.")
    ] = "auto",
    compensation: Annotated[
        str, typer.Option(help="Projection: exact, arctan, printed or none.")
    ] = "exact",
    interpolation: Annotated[str, typer.Option(help="sparse or thin_plate.")] = "sparse",
    gel: Annotated[str, typer.Option(help="linear or neo_hookean.")] = "linear",
    friction: Annotated[float, typer.Option(min=0, help="Coulomb coefficient.")] = 1.0,
    fields: Annotated[str, typer.Option(help="Force fields as npz, parquet or none.")] = "npz",
    pictures: Annotated[
        int, typer.Option(min=0, help="Overlay pictures to write, spread over the run.")
    ] = 6,
    video: Annotated[Path | None, typer.Option(help="Overlay video, .mp4 or .avi.")] = None,
    mcap: Annotated[Path | None, typer.Option(help="Recording with ROS 2 messages.")] = None,
    view: Annotated[bool, typer.Option("--view", help="Watch in a browser meanwhile.")] = False,
    most_frames: Annotated[
        int | None, typer.Option("--frames", min=1, help="Stop after so many frames.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--force", help="Replace an earlier run.")] = False,
    as_json: AsJson = False,
) -> int:
    """Estimate forces from marker frames.

    Follows the markers, corrects for projection, and applies the bundle's stiffness: force per
    node, pressure and traction, wrench with its standard deviation. Without an indenter, a depth
    or depth maps the normal force stays unknown. Writes a run folder: wrenches.csv, fields,
    overlay pictures.
    """
    from gelslim_cad.cli.budget import budget_of
    from gelslim_cad.cli.failure import CommandError
    from gelslim_cad.cli.force_report import answer_json, report
    from gelslim_cad.cli.force_sinks import result_sinks
    from gelslim_cad.cli.progress import progress_bar
    from gelslim_cad.cli.status import BAD_INPUT
    from gelslim_force.force_estimator import ForceSettings
    from gelslim_force.force_pipeline import ForcePipeline
    from gelslim_force.force_run import run_frames
    from gelslim_force.frame_source import open_frames
    from gelslim_force.pipeline_settings import PipelineSettings
    from ifem_export.bundle_io import load_bundle

    if fields not in ("npz", "parquet", "none"):
        raise CommandError(f"--fields {fields}: npz, parquet or none")
    if indenter and depth_maps:
        raise CommandError("give an indenter or depth maps, not both")
    budget = budget_of(error, within)
    sensor = load_bundle(bundle)
    if not budget.unlimited and operator is None:
        sensor = _budgeted(sensor, budget, bundle, gel)
    try:
        settings = PipelineSettings(
            rung=operator,  # type: ignore[arg-type]
            budget=budget,
            compensation=compensation,  # type: ignore[arg-type]
            interpolation=interpolation,  # type: ignore[arg-type]
            gel=gel,  # type: ignore[arg-type]
            force=ForceSettings(method=method, friction=friction),  # type: ignore[arg-type]
        )
    except ValueError as wrong:
        raise CommandError(str(wrong)) from wrong
    built, picture = _calibrated(sensor, reference, calibration, indenter is not None)
    with open_frames(frames) as source:
        pipeline = ForcePipeline(sensor, built, settings)
        pipeline.normal = _normal_source(pipeline, picture, indenter, depth_mm, depth_maps)
        folder = out or Path("out") / f"{bundle.resolve().name}-force"
        chosen = {
            "bundle": str(bundle), "frames": frames, "operator": pipeline.operator_name,
            "method": method, "compensation": compensation, "interpolation": interpolation,
            "gel": gel, "friction": friction, "indenter": indenter,
            "reference": str(reference) if reference else None,
            "calibration": str(calibration) if calibration else None,
        }  # fmt: skip
        with ExitStack() as stack, progress_bar(quiet=as_json) as tell:
            sinks, written = result_sinks(
                stack, pipeline, folder, chosen, fields, pictures, video, mcap, view, overwrite,
                source.frames_per_s or 30.0, quiet=as_json,
            )  # fmt: skip
            summary = run_frames(
                pipeline, _first(source, most_frames), sinks, source.count, progress=tell
            )
        files = [] if written is None else [str(f) for f in written.write()]
    if as_json:
        answer_json(folder, pipeline, summary, files)
    else:
        report(folder, pipeline, summary, files)
    return 0 if summary.with_forces else BAD_INPUT


def _budgeted(sensor: Bundle, budget: Budget, path: Path, gel: str) -> Bundle:
    """The sensor with this machine's times; what a budget cannot know of it is said."""
    from accuracy_budget.machine_times import read_times
    from gelslim_cad.cli.budget import note_choice, on_this_machine

    timed = on_this_machine(sensor)
    if timed.ladder is not None:
        choice = timed.ladder.choose(budget)
        if gel != "linear":
            told = f"the ladder was measured on a linear gel; its errors say little of {gel}"
            choice = replace(choice, remarks=(*choice.remarks, told))
        note_choice(choice, budget, bool(read_times(sensor.times_key)), f"gelslim bench {path}")
    return timed


def _calibrated(
    sensor: Bundle, reference: Path | None, file: Path | None, needs_picture: bool
) -> tuple[SensorCalibration, NDArray[np.uint8] | None]:
    from gelslim_cad.cli.failure import CommandError
    from gelslim_force.calibration import calibrate
    from gelslim_force.calibration_file import read_calibration
    from gelslim_force.reference_picture import read_reference

    if reference is None and (file is None or needs_picture):
        wanted = "the contact patch shows against it" if needs_picture else "or --calibration FILE"
        raise CommandError(f"give --reference PICTURE, one without contact ({wanted})")
    picture = None if reference is None else read_reference(reference)
    if file is not None:
        return read_calibration(file), picture
    assert picture is not None
    return calibrate(sensor, picture), picture


def _normal_source(
    pipeline: ForcePipeline,
    picture: NDArray[np.uint8] | None,
    indenter: str | None,
    depth_mm: float | None,
    depth_maps: Path | None,
) -> NormalSource | None:
    if depth_maps is not None:
        from gelslim_force.depth_source import DepthMapSource, read_depth_maps

        return DepthMapSource(
            pipeline.calibration.camera, pipeline.points_mm, read_depth_maps(depth_maps)
        )
    if indenter is None:
        return None
    from gelslim_force.indenter import parse_indenter
    from gelslim_force.indenter_source import indenter_source

    assert picture is not None
    return indenter_source(pipeline, picture, parse_indenter(indenter), depth_mm)


def _first(source: Any, most: int | None) -> Any:
    from itertools import islice

    return source if most is None else islice(source, most)
