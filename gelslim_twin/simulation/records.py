"""What a simulation records: the gel states of its poses and the true values of its frames.

States are written in chunks, each of them completely or not at all, so that a simulation can
resume.
"""

from __future__ import annotations

import csv
import io
import json
import zipfile
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.replaced_file import replace_file
from gelslim_force.forces.wrench import resultant
from gelslim_twin.contact.gel_state import ContactStatus, GelState
from gelslim_twin.scene.pose import Pose

Array = NDArray[np.float64]
CHUNK = 32
COLUMNS = (
    "frame", "time_s", "x_mm", "y_mm", "depth_mm", "twist_deg", "tilt_x_deg", "tilt_y_deg",
    "fx_n", "fy_n", "fz_n", "tx_nmm", "ty_nmm", "tz_nmm", "sticking_nodes", "slipping_nodes",
)  # fmt: skip


class StateStore:
    """States of a scene's poses in the order of the poses, `states_00000.npz` onwards."""

    def __init__(self, folder: Path) -> None:
        """Open a folder, which may hold chunks already."""
        self.folder = folder
        self._waiting: list[GelState] = []
        self._stored = self._whole_chunks()
        self._last: tuple[int, list[GelState]] | None = None

    @property
    def count(self) -> int:
        """States stored or waiting to be."""
        return self._stored + len(self._waiting)

    def append(self, state: GelState) -> None:
        """Add the next state; every 32nd writes a chunk."""
        self._waiting.append(state)
        if len(self._waiting) == CHUNK:
            self.flush()

    def flush(self) -> None:
        """Write the states that are not written yet. Only the last chunk may be incomplete."""
        if not self._waiting:
            return
        number = self._stored // CHUNK
        replace_file(self._path(number), _packed(self._waiting))
        self._stored += len(self._waiting)
        self._waiting = []
        self._last = None

    def __getitem__(self, index: int) -> GelState:
        """State `index`. Raises IndexError beyond the last, which ends a loop over all states."""
        if not 0 <= index < self.count:
            raise IndexError(index)
        if index >= self._stored:
            return self._waiting[index - self._stored]
        number = index // CHUNK
        if self._last is None or self._last[0] != number:
            self._last = number, _unpacked(self._path(number))
        return self._last[1][index % CHUNK]

    def _path(self, number: int) -> Path:
        return self.folder / f"states_{number:05d}.npz"

    def _whole_chunks(self) -> int:
        """Number of states in the readable chunks before the first gap."""
        total = number = 0
        while self._path(number).is_file():
            try:
                found = len(_unpacked(self._path(number)))
            except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
                break  # damaged: solved again from here on
            total, number = total + found, number + 1
            if found < CHUNK:
                break
        return total


def _packed(states: Sequence[GelState]) -> bytes:
    stream = io.BytesIO()
    np.savez(
        stream,
        displacement_mm=np.stack([s.displacement_mm for s in states]),
        force_n=np.stack([s.force_n for s in states]),
        touch=np.stack([s.touch for s in states]),
        solver=np.array([json.dumps(dict(s.solver), sort_keys=True) for s in states]),
    )
    return stream.getvalue()


def _unpacked(path: Path) -> list[GelState]:
    with np.load(path, allow_pickle=False) as held:
        u, f, touch = held["displacement_mm"], held["force_n"], held["touch"]
        solver = [json.loads(str(text)) for text in held["solver"]]
    return [GelState(*fields) for fields in zip(u, f, touch, solver, strict=True)]


@dataclass(frozen=True, eq=False)
class FrameTruth:
    """One frame."""

    number: int
    time_s: float
    pose: Pose
    """Tool at that time."""
    state: GelState
    markers_px: Array | None = None
    """(m, 2) images of the dots' centres, where markers are observed."""
    centroids_px: Array | None = None
    """(m, 2) centroids of the dots drawn, where a picture was."""
    drawn: NDArray[np.bool_] | None = None


def wrench_csv(frames: Sequence[FrameTruth], points_mm: Array) -> bytes:
    """A line per frame: tool pose, true wrench on the gel about the sensor origin, contact."""
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(COLUMNS)
    for frame in frames:
        force, torque = resultant(points_mm, frame.state.force_n)
        _, *place = astuple(frame.pose)
        numbers = [repr(float(v)) for v in (frame.time_s, *place, *force, *torque)]
        held = frame.state.touch
        nodes = [int((held == kind).sum()) for kind in (ContactStatus.STICK, ContactStatus.SLIP)]
        table.writerow([frame.number, *numbers, *nodes])
    return out.getvalue().encode()


def fields_npz(frames: Sequence[FrameTruth], points_mm: Array, observe: Sequence[str]) -> bytes:
    """Arrays over the frames: only what the scene observes.

    points_mm (c, 3), time_s (n,), displacement_mm (n, c, 3), force_n (n, c, 3), touch (n, c),
    markers_px (n, m, 2), centroids_px (n, m, 2), drawn (n, m).
    """
    held: dict[str, Array] = {
        "points_mm": points_mm,
        "time_s": np.array([f.time_s for f in frames]),
    }
    if "displacement" in observe:
        held["displacement_mm"] = np.stack([f.state.displacement_mm for f in frames])
    if "force" in observe:
        held["force_n"] = np.stack([f.state.force_n for f in frames])
        held["touch"] = np.stack([f.state.touch for f in frames])
    for name in ("markers_px", "centroids_px", "drawn"):
        values = [getattr(f, name) for f in frames]
        if all(v is not None for v in values):
            held[name] = np.stack(values)
    stream = io.BytesIO()
    np.savez(stream, **held)  # type: ignore[arg-type]
    return stream.getvalue()
