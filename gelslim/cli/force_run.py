"""Options and outputs of `gelslim force`: run folder, recording, video, view, pictures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from math import hypot
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import print_json, say
from gelslim.cli.failure import CommandError
from gelslim.cli.options import out_folder
from gelslim.cli.output import require_own_file
from gelslim.ending import Terminated
from gelslim_core.files.held_interrupt import interrupts_held

if TYPE_CHECKING:
    from gelslim_force.frames.frame import Frame
    from gelslim_force.outputs.overlay import Overlay
    from gelslim_force.outputs.sinks import PictureSink
    from gelslim_force.pipeline import ForcePipeline
    from gelslim_force.run import RunSummary


@dataclass(frozen=True)
class RunOutputs:
    """What a run writes, and where."""

    folder: Path
    fields: str
    """Format of the force fields: npz, parquet or none."""
    pictures: int
    """Overlay pictures, spread over the run."""
    video: Path | None
    mcap: Path | None
    rerun: Path | None
    view: bool
    """Show the run in a browser while it takes place."""
    overwrite: bool
    quiet: bool
    finger: Path | None = None
    """Model of the finger that the Rerun recording shows around the gel."""


def result_sinks(
    stack: ExitStack,
    pipeline: ForcePipeline,
    outputs: RunOutputs,
    chosen: dict[str, Any],
    frames_per_s: float,
) -> tuple[list[Any], PictureSink | None]:
    """Return the sinks of the results, and the picture sink, which writes at the end.

    `chosen` goes into the manifest of the run. Raises CommandError for a file that must not be
    replaced.
    """
    from gelslim_force.outputs.run_manifest import bundle_identity
    from gelslim_force.outputs.run_recorder import RecorderSettings, RunRecorder
    from gelslim_force.outputs.sinks import RecorderSink

    identity = bundle_identity(pipeline.bundle)
    overlay = _overlay(pipeline)
    sinks: list[Any] = []
    if outputs.mcap is not None:
        about = identity | _law_record(pipeline)
        sinks.append(_recording(stack, outputs.mcap, about, outputs.overwrite))
    if outputs.rerun is not None:
        sinks.append(_rerun_log(stack, outputs, outputs.rerun, pipeline))
    if outputs.video is not None:
        sinks.append(_video(stack, outputs.video, overlay, frames_per_s, outputs.overwrite))
    fields = None if outputs.fields == "none" else outputs.fields
    keep = RecorderSettings(fields=fields)  # type: ignore[arg-type]
    recorder = RunRecorder(outputs.folder, identity, chosen, keep, outputs.overwrite)
    sinks.insert(0, RecorderSink(stack.enter_context(recorder)))
    if outputs.view:
        sinks += _view_sinks(stack, overlay, pipeline, outputs.quiet)
    if not outputs.pictures:
        return sinks, None
    from gelslim_force.outputs.sinks import PictureSink

    kept = PictureSink(overlay, outputs.folder / "pictures", outputs.pictures)
    return [*sinks, kept], kept


def until_interrupted(frames: Iterable[Frame]) -> Iterator[Frame]:
    """Yield frames of a camera until Ctrl-C, which is the only way to end them.

    It takes effect while the next frame is waited for, so that the frame in work still goes to all
    outputs. SIGTERM interrupts as everywhere.
    """
    source = iter(frames)
    with interrupts_held() as let_through:
        while True:
            try:
                with let_through():
                    frame = next(source, None)
            except Terminated:
                raise
            except KeyboardInterrupt:
                return
            if frame is None:
                return
            yield frame


def _recording(stack: ExitStack, target: Path, identity: Any, overwrite: bool) -> Any:
    from gelslim_force.outputs.mcap_recording import McapRecording
    from gelslim_force.outputs.sinks import RecorderSink

    if overwrite:
        require_own_file(target, b"gelslim", "recording of gelslim")
        target.unlink(missing_ok=True)
    return RecorderSink(stack.enter_context(McapRecording(target, about=identity)))


def built_finger(bundle: Path) -> Path | None:
    """Model of the finger beside its bundle, where `gelslim build` wrote both."""
    models = sorted(bundle.resolve().parent.glob("*.glb"))
    return models[0] if len(models) == 1 else None


def _rerun_log(stack: ExitStack, outputs: RunOutputs, target: Path, pipeline: ForcePipeline) -> Any:
    from gelslim_force.outputs.rerun_log import RerunLog

    if target.exists() and not outputs.overwrite:
        raise CommandError(f"{target} exists; give another --rerun, or --force to replace it")
    rest_px = pipeline.calibration.reference.positions_px
    return stack.enter_context(RerunLog(target, rest_px, outputs.finger))


def _video(
    stack: ExitStack, target: Path, overlay: Overlay, frames_per_s: float, overwrite: bool
) -> Any:
    from gelslim_force.outputs.arrow_scale import Extent, LiveScale
    from gelslim_force.outputs.overlay_video import OverlayVideo
    from gelslim_force.outputs.sinks import VideoSink

    if target.exists() and not overwrite:
        raise CommandError(f"{target} exists; give another --video, or --force to replace it")
    made = stack.enter_context(OverlayVideo(target, overlay.size_px, frames_per_s))
    return VideoSink(overlay, made, LiveScale(Extent()))


def _view_sinks(
    stack: ExitStack, overlay: Overlay, pipeline: ForcePipeline, quiet: bool
) -> list[Any]:
    from gelslim_force.outputs.arrow_scale import Extent, LiveScale
    from gelslim_force.outputs.live_view import LiveView
    from gelslim_force.outputs.sinks import TareSink, ViewSink

    live = stack.enter_context(LiveView())
    if not quiet:
        print(f"Watch at {live.url}", flush=True)
    shown = ViewSink(overlay, live.show, LiveScale(Extent()), note=live.note)

    def tare(image: Any, time_s: float) -> str:
        shift = hypot(*pipeline.tare(image, time_s=time_s).shift_px)
        return f"new rest: the picture has moved by {shift:.2f} px since the calibration"

    return [shown, TareSink(tare, live.grant)]


def _overlay(pipeline: ForcePipeline) -> Overlay:
    from gelslim_force.outputs.overlay import Overlay

    camera = pipeline.calibration.camera
    return Overlay(
        (camera.image_height_px, camera.image_width_px),
        camera.project,
        pipeline.calibration.reference.positions_px,
    )


Frames = Annotated[
    str,
    typer.Argument(
        metavar="FRAMES", help="Folder of pictures, video, .npy array, or camera:0 for a camera."
    ),
]
Reference = Annotated[
    Path | None, typer.Option("-r", "--reference", help="Picture without contact.")
]
Calibration = Annotated[
    Path | None,
    typer.Option(
        "-c", "--calibration", help="File of `gelslim calibrate`, in place of the picture."
    ),
]
GelCalibration = Annotated[
    Path | None,
    typer.Option(help="File of `gelslim calibrate-gel`: the gel as built, with its uncertainty."),
]
LightCalibration = Annotated[
    Path | None,
    typer.Option(
        help="File of `gelslim calibrate-light`: the light as built, for objects of unknown shape."
    ),
]
RunFolder = Annotated[Path | None, out_folder("out/NAME-force", "Run folder to write")]
KnownIndenter = Annotated[
    str | None,
    typer.Option(
        help="Known indenter: sphere:10, cylinder:6, flat:5 or flat:4x8 (mm). Without it the shape "
        "is unknown, and forces are found from light and markers, in grey pictures from markers; "
        "none: tangential forces alone."
    ),
]
KnownDepth = Annotated[
    float | None,
    typer.Option(min=0, help="Known depth of the indenter in mm; a flat one needs it."),
]
DepthMaps = Annotated[
    Path | None,
    typer.Option(help="File .npy of heights (frames, h, w) in mm, registered to the pictures."),
]
DepthSigma = Annotated[
    float,
    typer.Option(
        min=0, help="Standard deviation of the depth maps in mm, where the gel is pressed in."
    ),
]
OperatorName = Annotated[str | None, typer.Option(help="Name of the force operator, such as fft.")]
Method = Annotated[str, typer.Option(help="Force method: auto, direct, low_pass or masked.")]
Compensation = Annotated[
    str, typer.Option(help="Correction for projection: exact, arctan, printed or none.")
]
Interpolation = Annotated[str, typer.Option(help="From markers to nodes: sparse or thin_plate.")]
GelLaw = Annotated[
    str,
    typer.Option(
        help="Law of the gel: auto takes the neo-Hookean one for contacts deeper than a tenth of "
        "the thickness; linear or neo_hookean at any depth."
    ),
]
FinerPressure = Annotated[
    bool,
    typer.Option(
        "--finer-pressure/--no-finer-pressure",
        help="Fit an unknown shape at last with normal forces at half the pitch of the nodes. "
        "Without it, a frame takes 75 % of the time, and normal forces are 2 % too small.",
    ),
]
Friction = Annotated[float, typer.Option(min=0, help="Coefficient of Coulomb friction.")]
Drift = Annotated[
    str,
    typer.Option(
        help="Small drift of the camera: correct, or count it as an error, for objects that stick "
        "to most of the gel."
    ),
]
DriftLimit = Annotated[
    float, typer.Option(min=0, help="Shift of the camera in px beyond which there are no forces.")
]
Rezero = Annotated[
    int | None,
    typer.Option(min=1, help="Frames without contact after which their drift is the new rest."),
]
FieldFormat = Annotated[str, typer.Option(help="Format of the force fields: npz, parquet or none.")]
OverlayVideo = Annotated[Path | None, typer.Option(help="Overlay video to write, .mp4 or .avi.")]
Recording = Annotated[
    Path | None, typer.Option(help="Recording with ROS 2 messages to write, .mcap.")
]
RerunRecording = Annotated[
    Path | None,
    typer.Option(help="Recording for the Rerun viewer to write, .rrd; needs the extra rerun."),
]
Latest = Annotated[
    bool | None,
    typer.Option(
        "--latest/--all-frames",
        help="Of a camera, always the newest frame, as by default; or all frames in order.",
        show_default=False,
    ),
]
LiveView = Annotated[bool, typer.Option("--view", help="Show the run in a browser.")]
ReplaceRun = Annotated[bool, typer.Option("--force", help="Replace an earlier run in the folder.")]


def answer_json(
    folder: Path, pipeline: ForcePipeline, summary: RunSummary, pictures: list[str]
) -> None:
    """Print the run's folder, counts, last wrench (N, N mm) and median times (ms) as JSON."""
    from gelslim_force.forces.record import plain

    wrench = summary.last.wrench if summary.last is not None else None
    print_json(
        {
            "folder": str(folder),
            "operator": pipeline.operator_name,
            "gel": pipeline.gel_law.record_of(summary.gel, "frames"),
            "frames": summary.frames,
            "frames_dropped": summary.dropped,
            "frames_with_forces": summary.with_forces,
            "problems": summary.problems,
            "least_coverage": summary.least_coverage,
            "last_wrench": None if wrench is None else plain(wrench.vector),
            "last_sigma": None if wrench is None else plain(wrench.standard_deviation),
            "stages_ms": summary.median_ms(),
            "pictures": pictures,
            "missing": list(_missing(pipeline)),
        }
    )


def report(folder: Path, pipeline: ForcePipeline, summary: RunSummary, pictures: list[str]) -> None:
    """Print the number of frames with forces, the last wrench, problems, times and folder."""
    from gelslim_force.joint.unknown_shape import UnknownShape

    by = pipeline.operator_name
    if isinstance(pipeline.normal, UnknownShape):
        lit = pipeline.normal.estimator.light is not None
        by = "light and markers" if lit else "the markers alone"
    say(f"{summary.frames} frames, {summary.with_forces} with forces, by {by}.")
    if summary.dropped:
        say(f"{summary.dropped} frames of the camera were dropped for newer ones.")
    for line in summary.gel.sentences(pipeline.gel_law):
        say(line)
    wrench = summary.last.wrench if summary.last is not None else None
    if wrench is not None:
        say(f"Last frame: {wrench}.")
    for problem, count in sorted(summary.problems.items(), key=lambda item: -item[1])[:5]:
        frames = "1 frame" if count == 1 else f"{count} frames, the first"
        say(f"{frames}: {problem}.", style="yellow")
    times = summary.median_ms()
    if times:
        total = times.pop("total")
        stages = ", ".join(f"{name} {value:.1f}" for name, value in times.items())
        say(f"Median {total:.1f} ms per frame ({stages}).")
    for line in _missing(pipeline):
        say(f"Not known of this sensor: {line}", style="yellow")
    say(f"Run in {folder}/" + (f", {len(pictures)} pictures in {folder}/pictures/" if pictures
                               else ""))  # fmt: skip


def _law_record(pipeline: ForcePipeline) -> dict[str, str]:
    """The law of the gel as metadata of a recording, which are texts."""
    record = pipeline.gel_law.record()
    return {f"gel_{name}": "" if value is None else str(value) for name, value in record.items()}


def _missing(pipeline: ForcePipeline) -> tuple[str, ...]:
    """What is not known of an imported sensor; empty for a generated one."""
    imported = pipeline.bundle.imported
    return () if imported is None else imported.missing
