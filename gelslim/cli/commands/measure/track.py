"""`gelslim track`: the dots of any marker sensor, followed in pixels without a bundle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import print_json, progress_bar, say
from gelslim.cli.failure import CommandError
from gelslim.cli.options import AsJson, MostFrames, OverlayPictures, out_folder
from gelslim.cli.output import replace_file, require_own_files

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from gelslim_force.dot_tracking import DotsAtRest
    from gelslim_force.frames.frame import FrameSource
    from gelslim_force.outputs.sinks import PictureSink
    from gelslim_force.outputs.track_record import TrackRecord


FILES = ("tracks.npz", "frames.csv", "summary.json")
"""Files of a run, in the order of writing."""


Frames = Annotated[
    str,
    typer.Argument(
        metavar="FRAMES",
        help="Folder of pictures, picture, video, .npy or .npz array, or camera:0 for a camera.",
    ),
]
Reference = Annotated[
    Path | None,
    typer.Option("-r", "--reference", help="Picture without contact; by default the first frame."),
]
TrackFolder = Annotated[Path | None, out_folder("out/NAME-track")]
Diameters = Annotated[
    str | None,
    typer.Option(
        "--diameters", help="Smallest and largest dot in px, such as 4:12; by default estimated."
    ),
]
FrameRate = Annotated[
    float | None,
    typer.Option("--rate", help="Frames per second, if the source does not know them."),
]


def track(
    frames: Frames,
    reference: Reference = None,
    out: TrackFolder = None,
    diameters_px: Diameters = None,
    frames_per_s: FrameRate = None,
    most_frames: MostFrames = None,
    pictures: OverlayPictures = 4,
    as_json: AsJson = False,
) -> int:
    """Follow the dots of any marker sensor, in pixels.

    Needs no bundle, because it finds the size of the dots and their lattice in the picture without
    contact. Writes tracks.npz (position, displacement and status of every marker), frames.csv with
    the coverage of each frame, summary.json, and overlay pictures. Ctrl-C ends a run with a camera
    and keeps its files.
    """
    from gelslim_force.calibration.reference_picture import read_reference
    from gelslim_force.frames.source import open_frames
    from gelslim_force.outputs.track_record import TrackRecord

    settings = _settings(diameters_px)
    # A bad reference must be refused before the source opens and frames are lost.
    rest = (
        None if reference is None else _at_rest(read_reference(reference), settings, str(reference))
    )
    folder = out or Path("out") / f"{_name(frames)}-track"
    require_own_files(folder, FILES, FILES[0], b"places_px")
    with open_frames(frames, frames_per_s) as source, progress_bar(quiet=as_json) as tell:
        first = _Frames(source, most_frames, tell)
        if rest is None:
            rest = _at_rest(first.first_picture(), settings, "the first frame")
        record = TrackRecord(rest)
        kept = _picture_sink(rest, folder, pictures)
        _follow(rest, first, record, kept)
    summary = {"source": frames, **record.summary()}
    _write(folder, record, summary)
    drawn = [] if kept is None else [str(f) for f in kept.write()]
    if as_json:
        print_json({"folder": str(folder), **summary, "pictures": drawn})
    else:
        _report(folder, summary, rest, len(drawn))
    return 0


def _write(folder: Path, record: TrackRecord, summary: dict[str, Any]) -> None:
    from gelslim_core.files.replaced_file import json_bytes

    tracks, table, told = FILES
    record.write(folder / tracks)
    replace_file(folder / table, record.table())
    replace_file(folder / told, json_bytes(summary))


class _Frames:
    """The frames of a source, including those that were read in advance."""

    def __init__(self, source: FrameSource, most: int | None, tell: Any) -> None:
        self.live, self._count, self._most, self._tell = source.live, source.count, most, tell
        self._frames = iter(source)
        self._ahead: list[Any] = []

    def first_picture(self) -> NDArray[np.uint8]:
        """Return the first frame that can be read; the iteration still yields it."""
        from gelslim_force.frames.frame import FrameSourceError

        for frame in self._frames:
            self._ahead.append(frame)
            if frame.image is not None:
                return frame.image
        why = self._ahead[0].problem if self._ahead else "there are no frames"
        raise FrameSourceError(f"no frame can be read: {why}")

    def __iter__(self) -> Any:
        from itertools import chain, islice

        total = min(n for n in (self._count, self._most, 10**9) if n is not None)
        every = islice(chain(self._ahead, self._frames), self._most)
        for done, frame in enumerate(every, 1):
            yield frame
            if self._tell is not None:
                self._tell("frames", done, total if total < 10**9 else done + 1)


def _follow(
    rest: DotsAtRest, frames: _Frames, record: TrackRecord, kept: PictureSink | None
) -> None:
    from dataclasses import replace

    from gelslim_force.dot_tracking import DotTracking

    tracking = DotTracking(rest)
    try:
        for frame in frames:
            result = tracking.follow(frame.image, frame.index, frame.time_s)
            result = replace(result, stamp_s=frame.stamp_s, sensor_s=frame.sensor_s)
            if frame.problem:
                result = replace(result, problems=(frame.problem,))
            record.take(result)
            if kept is not None:
                kept.take(frame.image, result)
    except KeyboardInterrupt:
        # Ctrl-C is the only way to end a camera.
        if not frames.live:
            raise


def _settings(diameters: str | None) -> Any:
    if diameters is None:
        return None
    import numpy as np

    from gelslim_force.detection.settings import DetectorSettings

    try:
        low, high = (float(part) for part in diameters.split(":"))
        return DetectorSettings.for_diameters(np.array([low, high]), "double")
    except ValueError as error:
        raise CommandError(
            f"--diameters {diameters}: give smallest and largest dot in px, such as 4:12 ({error})"
        ) from error


def _at_rest(image: NDArray[np.uint8], settings: Any, name: str) -> DotsAtRest:
    from gelslim_force.dot_tracking import dots_at_rest

    try:
        return dots_at_rest(image, settings)
    except ValueError as error:
        raise CommandError(f"{name}: {error}") from error


def _name(frames: str) -> str:
    stem = Path(frames).resolve().stem if Path(frames).exists() else frames
    return "".join(c if c.isalnum() or c in "-_." else "_" for c in stem)[:60] or "frames"


def _picture_sink(rest: DotsAtRest, folder: Path, most: int) -> PictureSink | None:
    from gelslim_force.outputs.overlay import Overlay
    from gelslim_force.outputs.sinks import PictureSink

    if not most:
        return None
    height, width = rest.image_shape[:2]
    overlay = Overlay((height, width), None, rest.reference.positions_px)
    return PictureSink(overlay, folder / "pictures", most)


def _report(folder: Path, summary: dict[str, Any], rest: DotsAtRest, pictures: int) -> None:
    rows, columns = rest.lattice_shape
    say(
        f"{summary['markers']} dots on a lattice of {rows} x {columns}, "
        f"{summary['on_lattice']:.1%} of those found, pitch {rest.pitch_px:.1f} px."
    )
    bad, seen = summary["frames_without_tracks"], summary["coverage"]
    say(f"{summary['frames']} frames" + (f", {bad} of them without tracks." if bad else "."))
    if seen["median"] is not None:
        peak = summary["largest_displacement_px"]
        moved = "" if peak is None else f"; largest displacement {peak:.2f} px"
        say(f"Coverage {seen['median']:.1%} in the median, {seen['least']:.1%} at least{moved}.")
    for index, text in list(summary["problems"].items())[:3]:
        say(f"Frame {index}: {text}.", style="yellow")
    if len(summary["problems"]) > 3:
        say(f"{len(summary['problems']) - 3} more such frames in frames.csv.", style="yellow")
    say(f"Wrote tracks.npz, frames.csv, summary.json and {pictures} pictures to {folder}/")
