"""What takes the results of `gelslim force`: run folder, recording, video, view, pictures."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gelslim_force.force_pipeline import ForcePipeline
    from gelslim_force.outputs.overlay import Overlay


def result_sinks(
    stack: ExitStack,
    pipeline: ForcePipeline,
    folder: Path,
    chosen: dict[str, Any],
    fields: str,
    pictures: int,
    video: Path | None,
    mcap: Path | None,
    view: bool,
    overwrite: bool,
    frames_per_s: float,
    quiet: bool,
) -> tuple[list[Any], Any]:
    """What takes the results; and the picture sink, which writes at the end."""
    from gelslim_cad.cli.failure import CommandError
    from gelslim_cad.cli.output import spare_strangers
    from gelslim_force.outputs.result_sinks import RecorderSink
    from gelslim_force.outputs.run_manifest import bundle_identity
    from gelslim_force.outputs.run_recorder import RecorderSettings, RunRecorder

    identity = bundle_identity(pipeline.bundle)
    overlay = _overlay(pipeline)
    sinks: list[Any] = []
    if mcap is not None:
        from gelslim_force.outputs.mcap_recording import McapRecording

        if overwrite:
            spare_strangers(mcap, b"gelslim", "recording of gelslim")
            mcap.unlink(missing_ok=True)
        sinks.append(RecorderSink(stack.enter_context(McapRecording(mcap, about=identity))))
    if video is not None:
        from gelslim_force.outputs.arrow_scale import Extent, LiveScale
        from gelslim_force.outputs.overlay_sink import VideoSink
        from gelslim_force.outputs.overlay_video import OverlayVideo

        if video.exists() and not overwrite:
            raise CommandError(f"{video} exists; give another --video, or --force to replace it")
        made = stack.enter_context(OverlayVideo(video, overlay.size_px, frames_per_s))
        sinks.append(VideoSink(overlay, made, LiveScale(Extent())))
    keep = RecorderSettings(fields=None if fields == "none" else fields)  # type: ignore[arg-type]
    recorder = stack.enter_context(RunRecorder(folder, identity, chosen, keep, overwrite))
    sinks.insert(0, RecorderSink(recorder))
    if view:
        sinks.append(_view_sink(stack, overlay, quiet))
    if not pictures:
        return sinks, None
    from gelslim_force.outputs.overlay_sink import PictureSink

    kept = PictureSink(overlay, folder / "pictures", pictures)
    return [*sinks, kept], kept


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
        pipeline.calibration.reference.places_px,
    )
