"""`gelslim force`: from marker frames to forces."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gelslim.cli import force_run as option
from gelslim.cli.answer import BAD_INPUT, progress_bar
from gelslim.cli.budget import FieldError, FrameTime, budget_of, note_choice, on_this_machine
from gelslim.cli.failure import CommandError
from gelslim.cli.force_run import (
    RunOutputs,
    answer_json,
    report,
    result_sinks,
    until_interrupted,
)
from gelslim.cli.options import AsJson, CameraResponse, MostFrames, OverlayPictures, SensorBundle

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from gelslim.cli.force_run import RunOutputs
    from gelslim_core.budget.budget import Budget
    from gelslim_force.built_sensor import BuiltGel
    from gelslim_force.calibration.sensor_calibration import Calibration
    from gelslim_force.contact.normal_source import NormalSource
    from gelslim_force.frames.source import ThreadedReader
    from gelslim_force.pipeline import ForcePipeline
    from gelslim_force.run import RunSummary
    from gelslim_force.settings import PipelineSettings
    from ifem_export.bundle.bundle import Bundle


def force(
    bundle: SensorBundle,
    frames: option.Frames,
    reference: option.Reference = None,
    calibration: option.Calibration = None,
    gel_calibration: option.GelCalibration = None,
    light_calibration: option.LightCalibration = None,
    out: option.RunFolder = None,
    indenter: option.KnownIndenter = None,
    depth_mm: option.KnownDepth = None,
    depth_maps: option.DepthMaps = None,
    depth_sigma_mm: option.DepthSigma = 0.0,
    error: FieldError = None,
    within: FrameTime = None,
    operator: option.OperatorName = None,
    method: option.Method = "auto",
    compensation: option.Compensation = "exact",
    interpolation: option.Interpolation = "sparse",
    gel: option.GelLaw = "auto",
    finer_pressure: option.FinerPressure = True,
    gamma: CameraResponse = None,
    friction: option.Friction = 1.0,
    drift: option.Drift = "correct",
    drift_px: option.DriftLimit = 0.5,
    rezero: option.Rezero = None,
    fields: option.FieldFormat = "npz",
    pictures: OverlayPictures = 6,
    video: option.OverlayVideo = None,
    mcap: option.Recording = None,
    rerun: option.RerunRecording = None,
    view: option.LiveView = False,
    latest: option.Latest = None,
    most_frames: MostFrames = None,
    overwrite: option.ReplaceRun = False,
    as_json: AsJson = False,
) -> int:
    """Estimate forces from marker frames.

    Follows the markers, corrects their motion for projection, and applies the stiffness of the
    bundle. Writes a run folder with the wrench of each frame and its standard deviation
    (wrenches.csv), the force at every node (fields), and overlay pictures. The object may have any
    shape; in grey pictures a weak normal force is unknown without depth maps. Ctrl-C ends a run
    with a camera and keeps its files.
    """
    from gelslim_force.built_sensor import built_gel, built_light
    from gelslim_force.frames.source import is_camera, open_frames
    from gelslim_force.pipeline import ForcePipeline
    from gelslim_force.sensor import normal_source
    from ifem_export.bundle.files import load_bundle

    _require_consistent(fields, indenter, depth_mm, depth_maps, depth_sigma_mm, light_calibration)
    if latest is not None and not is_camera(frames):
        raise CommandError(
            f"--latest and --all-frames choose between the frames of a camera, and {frames} is "
            "recorded: leave the option out"
        )
    if gamma is not None and light_calibration is not None:
        raise CommandError(
            "--light-calibration holds the response of the camera: leave --gamma out"
        )
    budget = budget_of(error, within)
    sensor = load_bundle(bundle)
    if not budget.unlimited and operator is None:
        sensor = _budgeted(sensor, budget, bundle, gel)
    chosen = {
        "operator": operator, "method": method, "compensation": compensation,
        "interpolation": interpolation, "gel": gel, "friction": friction,
        "finer_pressure": finer_pressure, "gamma": gamma,
        "drift": drift, "drift_px": drift_px, "rezero": rezero,
    }  # fmt: skip
    settings = _settings(chosen, budget)
    camera, picture = _calibrated(sensor, reference, calibration)
    built = built_gel(sensor, camera, gel_calibration, settings)
    light = built_light(sensor, light_calibration)
    folder = out or Path("out") / f"{bundle.resolve().name}-force"
    outputs = RunOutputs(
        folder, fields, pictures, video, mcap, rerun, view, overwrite, quiet=as_json,
        finger=option.built_finger(bundle),
    )  # fmt: skip
    with open_frames(frames, latest=latest) as source:
        if depth_maps is not None:
            normal: NormalSource | None = _depth_source(built, depth_maps, depth_sigma_mm)
        else:
            normal = normal_source(built, picture, indenter, depth_mm, settings, light)
        if indenter is None and normal is not None and depth_maps is None:
            _note_unused(operator is not None or not budget.unlimited or method != "auto")
        pipeline = ForcePipeline(built.bundle, built.calibration, settings, normal, built.share)
        if source.live:
            pipeline.prepare()
        manifest = {
            "bundle": str(bundle), "frames": frames,
            **chosen, "operator": pipeline.operator_name, "indenter": indenter,
            "reference": str(reference) if reference else None,
            "calibration": str(calibration) if calibration else None,
            "gel_calibration": str(gel_calibration) if gel_calibration else None,
            "light_calibration": str(light_calibration) if light_calibration else None,
            "gel_law": pipeline.gel_law.law, "gel_fallback": pipeline.gel_law.fallback or None,
        }  # fmt: skip
        summary, drawn = _run(pipeline, source, most_frames, outputs, manifest)
    say = answer_json if as_json else report
    say(folder, pipeline, summary, drawn)
    return 0 if summary.with_forces else BAD_INPUT


def _require_consistent(
    fields: str,
    indenter: str | None,
    depth_mm: float | None,
    depth_maps: Path | None,
    depth_sigma_mm: float,
    light_calibration: Path | None,
) -> None:
    if fields not in ("npz", "parquet", "none"):
        raise CommandError(f"--fields {fields}: give npz, parquet or none")
    if indenter in (None, "none", "unknown") and depth_mm is not None:
        raise CommandError("--depth-mm is the depth of an indenter of known shape: give its shape")
    if indenter and depth_maps:
        raise CommandError("give --indenter or --depth-maps, not both")
    if depth_sigma_mm and not depth_maps:
        raise CommandError("--depth-sigma-mm is that of --depth-maps: give these too")
    if light_calibration and (depth_maps or indenter not in (None, "unknown")):
        raise CommandError(
            "--light-calibration serves objects of unknown shape: leave --indenter and "
            "--depth-maps out"
        )


def _note_unused(chosen: bool) -> None:
    """Say on standard error that a chosen operator or method has no part in the result."""
    if chosen:
        print(
            "gelslim: the forces of an unknown shape need no operator or method; these serve with "
            "--indenter none, a known indenter or --depth-maps",
            file=sys.stderr,
        )


def _settings(chosen: dict[str, Any], budget: Budget) -> PipelineSettings:
    """Return the settings of the pipeline for these options. Raises CommandError."""
    from gelslim_force.forces.estimator import ForceSettings
    from gelslim_force.joint.settings import USUAL_GAMMA
    from gelslim_force.settings import PipelineSettings
    from gelslim_force.tracking.drift_filter import DriftSettings

    if chosen["drift"] not in ("correct", "count"):
        raise CommandError(f"--drift {chosen['drift']}: give correct or count")
    try:
        return PipelineSettings(
            rung=chosen["operator"],
            budget=budget,
            compensation=chosen["compensation"],
            interpolation=chosen["interpolation"],
            gel=chosen["gel"],
            finer_pressure=chosen["finer_pressure"],
            gamma=USUAL_GAMMA if chosen["gamma"] is None else chosen["gamma"],
            force=ForceSettings(method=chosen["method"], friction=chosen["friction"]),
            drift=DriftSettings(
                correct=chosen["drift"] == "correct",
                most_px=chosen["drift_px"],
                rezero_frames=chosen["rezero"],
            ),
        )
    except ValueError as wrong:
        raise CommandError(str(wrong)) from wrong


def _run(
    pipeline: ForcePipeline,
    source: ThreadedReader,
    most_frames: int | None,
    outputs: RunOutputs,
    chosen: dict[str, Any],
) -> tuple[RunSummary, list[str]]:
    """Process the frames; return the summary and the paths of the pictures."""
    from itertools import islice

    from gelslim_force.run import run_frames

    frames_per_s = source.frames_per_s or 30.0
    with ExitStack() as stack, progress_bar(quiet=outputs.quiet) as tell:
        sinks, kept = result_sinks(stack, pipeline, outputs, chosen, frames_per_s)
        every = until_interrupted(source) if source.live else source
        frames = every if most_frames is None else islice(every, most_frames)
        summary = run_frames(pipeline, frames, sinks, source.count, progress=tell)
        summary = replace(summary, dropped=source.dropped)
    return summary, [] if kept is None else [str(f) for f in kept.write()]


def _budgeted(sensor: Bundle, budget: Budget, path: Path, gel: str) -> Bundle:
    """Return the sensor with the times of this machine, and print the remarks on the budget."""
    from gelslim_core.budget.machine_times import read_times

    timed = on_this_machine(sensor)
    if timed.ladder is not None:
        choice = timed.ladder.choose(budget)
        if gel != "linear":
            where = "deep contacts" if gel == "auto" else "this gel"
            remark = f"the ladder was measured on a linear gel; its errors are not those of {where}"
            choice = replace(choice, remarks=(*choice.remarks, remark))
        here = choice.rung.name in read_times(sensor.times_key)
        note_choice(choice, budget, here, f"gelslim bench {path}")
    return timed


def _calibrated(
    sensor: Bundle, reference: Path | None, file: Path | None
) -> tuple[Calibration, NDArray[np.uint8] | None]:
    from gelslim_force.calibration.calibration import calibrate
    from gelslim_force.calibration.file import read_calibration
    from gelslim_force.calibration.reference_picture import read_reference

    if reference is None and file is None:
        raise CommandError(
            "give --reference PICTURE, a picture without contact, or --calibration FILE"
        )
    picture = None if reference is None else read_reference(reference)
    if file is not None:
        return read_calibration(file), picture
    assert picture is not None
    return calibrate(sensor, picture), picture


def _depth_source(built: BuiltGel, depth_maps: Path, sigma_mm: float) -> NormalSource:
    from gelslim_force.contact.depth_map_source import DepthMapSource, read_depth_maps

    points_mm, maps = built.bundle.mesh.surface_mm, read_depth_maps(depth_maps)
    return DepthMapSource(built.calibration.camera, points_mm, maps, sigma_mm)
