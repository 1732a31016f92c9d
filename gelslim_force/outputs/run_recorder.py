"""Recording of a run: what was appended survives a kill of the process.

run.json               manifest with settings, versions and counts; rewritten with each chunk
wrenches.csv           a line per frame, see `wrench_csv`
stages.jsonl           a JSON object per frame: its index, and milliseconds by stage
fields_00000.npz       chunk of frames with markers and nodes, see `field_chunk`
fields_00001.part      journal of the present chunk, see `frame_journal`
"""

from __future__ import annotations

import contextlib
import json
import os
import re
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from gelslim_core import optional_library
from gelslim_core.errors import OutputError, disk_error
from gelslim_core.files.file_lock import locked
from gelslim_core.files.held_interrupt import interrupts_held
from gelslim_core.files.replaced_file import sweep
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.forces.record import plain
from gelslim_force.outputs import wrench_csv
from gelslim_force.outputs.field_chunk import ChunkWriter, Format, fits
from gelslim_force.outputs.frame_journal import AppendFile, record
from gelslim_force.outputs.packed_frame import PackedFrame, Precision, pack
from gelslim_force.outputs.run_manifest import (
    FORMAT_NAME,
    MANIFEST,
    UNITS,
    RunCounts,
    State,
    read_manifest,
    versions,
    write_manifest,
)

LOCK = ".lock"
WRENCHES, STAGES = "wrenches.csv", "stages.jsonl"
FIELD_FILE = re.compile(r"fields_(\d{5,})\.(npz|parquet|part)")


@dataclass(frozen=True)
class RecorderSettings:
    """What is recorded of a run. Raises ValueError for impossible values."""

    fields: Format | None = "npz"
    """Format of the markers and nodes of each frame; None records the wrenches only."""
    precision: Precision = "float32"
    frames_per_chunk: int = 64

    def __post_init__(self) -> None:
        if self.fields not in (None, *get_args(Format)):
            raise ValueError(f"fields = {self.fields!r}: must be npz, parquet or None")
        if self.precision not in get_args(Precision):
            raise ValueError(f"precision = {self.precision!r}: must be float32 or float64")
        if not 1 <= self.frames_per_chunk <= 10_000:
            raise ValueError(f"frames_per_chunk = {self.frames_per_chunk}: must be in 1 ... 10000")


@dataclass
class _OpenChunk:
    """The present chunk; its journal is created with the first frame."""

    number: int
    frames: list[PackedFrame] = field(default_factory=list)
    journal: AppendFile | None = None
    first: PackedFrame | None = None
    """The first frame that has markers."""
    points_mm: NDArray[np.float64] | None = None

    def accepts(self, frame: PackedFrame) -> bool:
        return fits(self.first, self.points_mm, frame)

    def add(self, frame: PackedFrame) -> None:
        self.frames.append(frame)
        if self.first is None and frame.markers:
            self.first = frame
        if self.points_mm is None:
            self.points_mm = frame.points_mm


class RunRecorder(AbstractContextManager["RunRecorder"]):
    """Writes results in the order of their index to a folder.

    Attributes:
        folder: The folder of the run.

    >>> with RunRecorder("out/run") as run:  # doctest: +SKIP
    ...     for result in results:
    ...         run.append(result)
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        bundle: Mapping[str, str] | None = None,
        settings: Mapping[str, Any] | None = None,
        keep: RecorderSettings | None = None,
        overwrite: bool = False,
    ) -> None:
        """Start a run.

        Args:
            folder: Folder of the run.
            bundle: `bundle_identity(...)`, for the manifest.
            settings: Settings of the pipeline, for the manifest.
            keep: What is recorded.
            overwrite: Whether an earlier run in the folder is deleted.

        Raises:
            OutputError: The folder holds a run and `overwrite` is false, or it cannot be written.
            MissingLibraryError: Parquet is asked for and pyarrow is not installed.
        """
        self.folder = Path(folder)
        self._keep = keep or RecorderSettings()
        if self._keep.fields == "parquet":
            optional_library.load("pyarrow.parquet", "Parquet")
        self._about: dict[str, Any] = {
            "bundle": dict(bundle) if bundle else None,
            "versions": versions(),
            "settings": plain(settings or {}),
        }
        self._counts = RunCounts()
        self._rests: list[Any] = []
        self._last_index: int | None = None
        self._open = False
        self._chunk = _OpenChunk(0)
        self._lock = contextlib.ExitStack()
        try:
            self._take_folder()
            self._make_room(overwrite)
            self._write_manifest("running")
            self._csv = AppendFile(self.folder / WRENCHES)
            self._stages = AppendFile(self.folder / STAGES)
            self._csv.append(wrench_csv.header().encode())
        except OSError as error:
            self._lock.close()
            raise disk_error(self.folder, "starting the run", error) from error
        except BaseException:
            self._lock.close()
            raise
        self._writer = ChunkWriter(self._checkpoint)
        self._open = True

    def append(self, result: FrameResult) -> None:
        """Write a frame. Raises OutputError; the frames before it stay readable."""
        if not self._open:
            raise OutputError(f"{self.folder}: the run is already finished; start another one")
        if self._last_index is not None and result.index <= self._last_index:
            raise OutputError(
                f"{self.folder}: frame {result.index} comes after frame "
                f"{self._last_index}; indices must increase"
            )
        try:
            self._writer.check()
            self._csv.append(wrench_csv.line(result).encode("utf-8", wrench_csv.ESCAPE))
            if result.stage_ms:
                stages = {"index": int(result.index), **plain(result.stage_ms)}
                self._stages.append((json.dumps(stages) + "\n").encode())
            if self._keep.fields:
                self._append_fields(pack(result, self._keep.precision))
        except (OutputError, OSError) as error:
            raise self._failed(f"writing frame {result.index}", error) from error
        self._last_index = int(result.index)
        self._counts.add(result)
        self._rests += plain(result.extra.get("rests", []))

    def finish(self, reason: str = "") -> None:
        """Write the last chunk and the state of the run; `reason` if it stopped early.

        A second call does nothing. Raises OutputError.
        """
        if not self._open:
            return
        try:
            self._end_chunk()
        except (OutputError, OSError) as error:
            raise self._failed("finishing the run", error) from error
        self._close("stopped" if reason else "complete", reason)
        self._writer.check()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: object
    ) -> None:
        """Finish; after an error in the block, that error is the reason and the one to report."""
        if kind is None:
            self.finish()
            return
        with contextlib.suppress(OutputError):
            self.finish(f"{kind.__name__}: {error}")

    def _append_fields(self, frame: PackedFrame) -> None:
        chunk = self._chunk
        if len(chunk.frames) >= self._keep.frames_per_chunk or not chunk.accepts(frame):
            self._end_chunk()
            chunk = self._chunk
        if chunk.journal is None:
            chunk.journal = AppendFile(self._chunk_path("part"))
        chunk.journal.append(record(frame, with_points=chunk.points_mm is None))
        chunk.add(frame)

    def _end_chunk(self) -> None:
        done = self._chunk
        if done.journal is None:
            return
        done.journal.close()
        target = self._chunk_path(str(self._keep.fields))
        self._writer.submit(target, done.journal.path, done.frames)
        self._chunk = _OpenChunk(done.number + 1)

    def _chunk_path(self, suffix: str) -> Path:
        return self.folder / f"fields_{self._chunk.number:05d}.{suffix}"

    def _checkpoint(self) -> None:
        """Force lines and counts to the disk before each chunk, on the thread of the writer."""
        self._csv.sync()
        self._stages.sync()
        self._write_manifest("running")

    def _failed(self, doing: str, error: OutputError | OSError) -> OutputError:
        """Close the run and return the error to raise."""
        failure = disk_error(self.folder, doing, error) if isinstance(error, OSError) else error
        self._close("stopped", str(failure))
        return failure

    def _close(self, state: State, reason: str) -> None:
        """End the run; where the disk refuses even this, `run.json` keeps its last state.

        An interrupt takes effect at its end: the second thread must not be left to write alone.
        """
        with interrupts_held():
            self._end(state, reason)

    def _end(self, state: State, reason: str) -> None:
        self._open = False
        self._writer.close()
        try:
            self._writer.check()
        except OutputError as error:
            state, reason = "stopped", reason or str(error)
        try:
            self._csv.sync()
            self._write_manifest(state, reason)
        except OSError as error:
            if state == "complete":
                raise disk_error(self.folder, "finishing the run", error) from error
        finally:
            for file in (self._csv, self._stages, self._chunk.journal):
                if file is not None:
                    file.close()
            self._lock.close()

    def _write_manifest(self, state: State, reason: str = "") -> None:
        write_manifest(
            self.folder,
            {
                "format": FORMAT_NAME,
                "state": state,
                "reason": reason,
                **self._about,
                "fields": asdict(self._keep),
                "units": dict(UNITS),
                "counts": asdict(self._counts),
                "rests": self._rests,
            },
        )

    def _take_folder(self) -> None:
        def refuse(_: Path) -> None:
            raise OutputError(
                f"{self.folder}: another process is writing a run there; choose another folder"
            )

        self.folder.mkdir(parents=True, exist_ok=True)
        self._lock.enter_context(locked(self.folder / LOCK, refuse))
        sweep(self.folder, again=True)

    def _make_room(self, overwrite: bool) -> None:
        fixed = (MANIFEST, WRENCHES, STAGES)
        found = [
            p for p in self.folder.iterdir() if p.name in fixed or FIELD_FILE.fullmatch(p.name)
        ]
        if found and not overwrite:
            raise OutputError(
                f"{self.folder}: it already holds a run; choose another folder or overwrite the run"
            )
        if MANIFEST in (p.name for p in found):
            read_manifest(self.folder)  # the run.json of another program is not deleted
        for path in sorted(found):
            path.unlink()
