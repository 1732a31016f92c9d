"""What takes the results of `gelslim force`: run folder, recording, video, view, pictures."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gelslim_force.outputs.overlay import Overlay
    from gelslim_force.outputs.overlay_sink import PictureSink
    from gelslim_force.pipeline import ForcePipeline


@dataclass(frozen=True)
class RunOutputs:
    """What a run is to write, and where."""

    folder: Path
    fields: str
    """Format of the force fields: npz, parquet or none."""
    pictures: int
    """Overlay pictures, spread over the run."""
    video: Path | None
    mcap: Path | None
    view: bool
    """Show the run in a browser meanwhile."""
    overwrite: bool
    quiet: bool


def result_sinks(
    stack: ExitStack,
    pipeline: ForcePipeline,
    outputs: RunOutputs,
    chosen: dict[str, Any],
    frames_per_s: float,
) -> tuple[list[Any], PictureSink | None]:
    """What takes the results; and the picture sink, which writes at the end.

    `chosen` goes into the run's manifest. Raises CommandError for files that are not to be
    replaced.
    """
    from gelslim_force.outputs.result_sinks import RecorderSink
    from gelslim_force.outputs.run_manifest import bundle_identity
    from gelslim_force.outputs.run_recorder import RecorderSettings, RunRecorder

    identity = bundle_identity(pipeline.bundle)
    overlay = _overlay(pipeline)
    sinks: list[Any] = []
    if outputs.mcap is not None:
        sinks.append(_recording(stack, outputs.mcap, identity, outputs.overwrite))
    if outputs.video is not None:
        sinks.append(_video(stack, outputs.video, overlay, frames_per_s, outputs.overwrite))
    fields = None if outputs.fields == "none" else outputs.fields
    keep = RecorderSettings(fields=fields)  # type: ignore[arg-type]
    recorder = RunRecorder(outputs.folder, identity, chosen, keep, outputs.overwrite)
    sinks.insert(0, RecorderSink(stack.enter_context(recorder)))
    if outputs.view:
        sinks.append(_view_sink(stack, overlay, outputs.quiet))
    if not outputs.pictures:
        return sinks, None
    from gelslim_force.outputs.overlay_sink import PictureSink

    kept = PictureSink(overlay, outputs.folder / "pictures", outputs.pictures)
    return [*sinks, kept], kept


def _recording(stack: ExitStack, target: Path, identity: Any, overwrite: bool) -> Any:
    from gelslim.cli.output import spare_strangers
    from gelslim_force.outputs.mcap_recording import McapRecording
    from gelslim_force.outputs.result_sinks import RecorderSink

    if overwrite:
        spare_strangers(target, b"gelslim", "recording of gelslim")
        target.unlink(missing_ok=True)
    return RecorderSink(stack.enter_context(McapRecording(target, about=identity)))


def _video(
    stack: ExitStack, target: Path, overlay: Overlay, frames_per_s: float, overwrite: bool
) -> Any:
    from gelslim.cli.failure import CommandError
    from gelslim_force.outputs.arrow_scale import Extent, LiveScale
    from gelslim_force.outputs.overlay_sink import VideoSink
    from gelslim_force.outputs.overlay_video import OverlayVideo

    if target.exists() and not overwrite:
        raise CommandError(f"{target} exists; give another --video, or --force to replace it")
    made = stack.enter_context(OverlayVideo(target, overlay.size_px, frames_per_s))
    return VideoSink(overlay, made, LiveScale(Extent()))


def _view_sink(stack: ExitStack, overlay: Overlay, quiet: bool) -> Any:
    from gelslim_force.outputs.arrow_scale import Extent, LiveScale
    from gelslim_force.outputs.live_view import LiveView
    from gelslim_force.outputs.overlay_sink import ViewSink

    live = stack.enter_context(LiveView())
    if not quiet:
        print(f"Watch at {live.url}", flush=True)
    return ViewSink(overlay, live.show, LiveScale(Extent()))


def _overlay(pipeline: ForcePipeline) -> Overlay:
    from gelslim_force.outputs.overlay import Overlay

    camera = pipeline.calibration.camera
    return Overlay(
        (camera.image_height_px, camera.image_width_px),
        camera.project,
        pipeline.calibration.reference.positions_px,
    )
