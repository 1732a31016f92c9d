"""Chunks written on a second thread, so that the frame that fills one is not late."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

from gelslim_core.files.output_error import OutputError, disk_error
from gelslim_force.outputs.field_chunk import stack, write_chunk
from gelslim_force.outputs.packed_frame import PackedFrame

_WAITING = 2
"""Chunks held in memory at most; `submit` waits for room."""


class ChunkWriter:
    """Turns finished journals into chunks. The journal goes when its chunk is safe."""

    def __init__(self, before: Callable[[], None]) -> None:
        """`before` runs ahead of each chunk, on the second thread."""
        self._before = before
        self._queue: queue.Queue[tuple[Path, Path, Sequence[PackedFrame]] | None] = queue.Queue(
            _WAITING
        )
        self._error: OutputError | None = None
        self._thread = threading.Thread(target=self._work, name="chunk-writer", daemon=True)
        self._thread.start()

    def submit(self, target: Path, journal: Path, frames: Sequence[PackedFrame]) -> None:
        """Hand over a closed journal and its frames. Raises OutputError of an earlier chunk."""
        self.check()
        self._queue.put((target, journal, frames))

    def check(self) -> None:
        """Raise OutputError where a chunk could not be written; its journal is still there."""
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """Wait for all chunks; raises nothing, see `check`."""
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join()

    def _work(self) -> None:
        while (item := self._queue.get()) is not None:
            target, journal, frames = item
            try:
                if self._error is None:
                    self._before()
                    write_chunk(target, stack(frames))
                    journal.unlink()
            except OutputError as error:
                self._error = error
            except OSError as error:
                self._error = disk_error(target, "writing a chunk of fields", error)
            except Exception as error:  # a thread must not die silently
                self._error = OutputError(f"{target}: {type(error).__name__}: {error}")
