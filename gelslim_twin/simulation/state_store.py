"""Gel states on disk, in chunks that are written atomically, so that a simulation can resume."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from gelslim_core.files.replaced_file import replace_file
from gelslim_twin.contact.gel_state import GelState

CHUNK = 32


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
        """State `index`. Raises IndexError beyond the last."""
        if not 0 <= index < self.count:
            raise IndexError(index)
        if index >= self._stored:
            return self._waiting[index - self._stored]
        number = index // CHUNK
        if self._last is None or self._last[0] != number:
            self._last = number, _unpacked(self._path(number))
        return self._last[1][index % CHUNK]

    def __iter__(self) -> Iterator[GelState]:
        """All states."""
        return (self[k] for k in range(self.count))

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
