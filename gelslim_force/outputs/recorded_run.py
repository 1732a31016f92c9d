"""A recorded run read back, whether it was finished, stopped or killed."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np

from gelslim_core.errors import OutputError, disk_error
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.outputs.field_chunk import FieldChunk, Format, read_chunk, stack
from gelslim_force.outputs.frame_journal import read_journal
from gelslim_force.outputs.packed_frame import PackedFrame
from gelslim_force.outputs.run_manifest import read_manifest
from gelslim_force.outputs.run_recorder import FIELD_FILE, STAGES, WRENCHES
from gelslim_force.outputs.wrench_csv import NUMBERS, WrenchTable, read_wrenches


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """A run folder; its wrenches are in memory, its fields are read when they are needed."""

    folder: Path
    manifest: Mapping[str, Any]
    """`run.json`; the counts of a killed run are those of its last chunk."""
    wrenches: WrenchTable
    stage_ms: Mapping[int, Mapping[str, float]]
    """Stage times by frame index."""
    incomplete: tuple[str, ...]
    """Files whose last line or record is incomplete."""

    @property
    def complete(self) -> bool:
        """Whether the run was finished."""
        return bool(self.manifest["state"] == "complete")

    def __len__(self) -> int:
        """Return the number of frames in `wrenches.csv`."""
        return len(self.wrenches)

    def chunks(self) -> Iterator[FieldChunk]:
        """Yield the chunks of fields in order. Raises OutputError for a damaged chunk."""
        for path in field_files(self.folder):
            frames = _journal(path)[0] if path.suffix == ".part" else None
            if frames is None:
                yield read_chunk(_now(path))
            elif frames:
                yield stack(frames)

    def results(self) -> Iterator[FrameResult]:
        """Yield the results in order, in the precision of the recording."""
        for chunk in self.chunks():
            yield from chunk.results(self.stage_ms)


def read_run(folder: str | os.PathLike[str]) -> RecordedRun:
    """Open the folder of a run, also of one that was stopped, was killed or still goes on.

    Args:
        folder: The folder that a `RunRecorder` wrote.

    Returns:
        The run; its wrenches are in memory, its fields are read when they are needed.

    Raises:
        OutputError: The folder holds no run, or a file is damaged.
    """
    root = Path(folder)
    manifest = read_manifest(root)
    path = root / WRENCHES
    if path.exists():
        wrenches = read_wrenches(path)
    else:  # the process was killed before the first line
        wrenches = WrenchTable(np.zeros((0, len(NUMBERS))), (), incomplete=True)
    stage_ms, stages_cut = _read_stages(root / STAGES)
    incomplete = [WRENCHES] * wrenches.incomplete + [STAGES] * stages_cut
    for part in field_files(root):
        if part.suffix == ".part" and _journal(part)[1]:
            incomplete.append(part.name)
    return RecordedRun(root, manifest, wrenches, stage_ms, tuple(incomplete))


def field_files(folder: Path) -> list[Path]:
    """Return the files of fields in order: each chunk, or its journal if it has no chunk yet.

    Raises:
        OutputError: The folder cannot be listed.
    """
    best: dict[int, Path] = {}
    try:
        names = sorted(folder.iterdir())
    except OSError as error:
        raise disk_error(folder, "listing the run", error) from error
    for path in names:
        match = FIELD_FILE.fullmatch(path.name)
        if match and (int(match[1]) not in best or path.suffix != ".part"):
            best[int(match[1])] = path
    return [best[number] for number in sorted(best)]


def _now(path: Path) -> Path:
    """The chunk that has replaced a journal since the folder was listed, in a run that goes on."""
    if path.suffix == ".part" and not path.exists():
        for suffix in get_args(Format):
            chunk = path.with_suffix(f".{suffix}")
            if chunk.exists():
                return chunk
    return path


def _journal(path: Path) -> tuple[list[PackedFrame] | None, bool]:
    """Frames of a journal and whether its end is incomplete; None if a chunk has replaced it."""
    try:
        return read_journal(path)
    except OSError as error:
        if _now(path) != path:
            return None, False
        raise disk_error(path, "reading fields", error) from error


def _read_stages(path: Path) -> tuple[dict[int, dict[str, float]], bool]:
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return {}, False
    except OSError as error:
        raise disk_error(path, "reading stage times", error) from error
    whole, newline, rest = data.rpartition(b"\n")
    times = {}
    for number, text in enumerate((whole + newline).splitlines(), start=1):
        try:
            line = json.loads(text)
            index = int(line.pop("index"))
            times[index] = {str(k): math.nan if v is None else float(v) for k, v in line.items()}
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise OutputError(f"{path}, line {number}: damaged ({error})") from error
    return times, bool(rest)
