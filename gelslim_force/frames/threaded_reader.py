"""A source read ahead in a thread: old live frames are dropped, recorded frames never."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from threading import Condition, Thread

from gelslim_force.frames.frame import Frame, FrameSource

_JOIN_S = 5.0


class ThreadedReader(FrameSource):
    """Reads a source in a thread of its own, so that decoding and computing overlap.

    The latest frame of a live source replaces one that has not been taken yet; a recorded source
    waits while `ahead` frames are in the buffer. It can be iterated once.
    """

    def __init__(self, source: FrameSource, ahead: int = 4) -> None:
        """Reading starts with the first `next`. Raises ValueError for `ahead` < 1."""
        if ahead < 1:
            raise ValueError(f"ahead = {ahead}: must be at least 1")
        self.source, self.live = source, source.live
        self.count, self.frames_per_s = source.count, source.frames_per_s
        self._ahead = 1 if source.live else ahead
        self._buffer: deque[Frame] = deque()
        self._changed = Condition()
        self._error: BaseException | None = None
        self._ended = self._stopped = False
        self._thread: Thread | None = None
        self.dropped = 0
        """Number of frames that were dropped."""

    def __iter__(self) -> Iterator[Frame]:
        """Yield frames; an error of the source is raised after the frames before it."""
        if self._thread is None:
            self._thread = Thread(target=self._read, name="frames", daemon=True)
            self._thread.start()
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._buffer or self._ended or self._stopped)
                if self._stopped:
                    return
                if not self._buffer:
                    if self._error is not None:
                        raise self._error
                    return
                frame = self._buffer.popleft()
                self._changed.notify_all()
            yield frame

    def close(self) -> None:
        """Stop the thread and close the source."""
        with self._changed:
            self._stopped = True
            self._changed.notify_all()
        self.source.close()
        if self._thread is not None:
            self._thread.join(_JOIN_S)

    def _read(self) -> None:
        try:
            for frame in self.source:
                if not self._put(frame):
                    break
        except BaseException as error:
            self._error = error
        finally:
            with self._changed:
                self._ended = True
                self._changed.notify_all()

    def _put(self, frame: Frame) -> bool:
        with self._changed:
            if not self.live:
                self._changed.wait_for(lambda: self._stopped or len(self._buffer) < self._ahead)
            elif self._buffer:
                self._buffer.popleft()
                self.dropped += 1
            if self._stopped:
                return False
            self._buffer.append(frame)
            self._changed.notify_all()
            return True
