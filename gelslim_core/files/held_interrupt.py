"""Ctrl-C and SIGTERM held back over a stretch that must not be cut."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import FrameType
from typing import Any

LetThrough = Callable[[], AbstractContextManager[None]]


@contextmanager
def interrupts_held() -> Iterator[LetThrough]:
    """Let a Ctrl-C or SIGTERM take effect at the end of the block, not within.

    The value makes blocks inside this one in which they take effect at once: what is made before
    such a block and removed after it is removed whenever they come. Libraries of compiled code
    crash, or say that they are not installed, where an interrupt falls into their start.

    Signals that no Python code handles stay as they are. In another thread than the main one,
    which gets no Ctrl-C, nothing is held.
    """
    if threading.current_thread() is not threading.main_thread():
        yield _nothing
        return
    held = _Held()
    try:
        held.hold()
        yield lambda: _LetThrough(held)
    finally:
        held.release()


@contextmanager
def _nothing() -> Iterator[None]:
    yield


class _Held:
    """Signals taken over, with the handlers they had."""

    def __init__(self) -> None:
        self._before: dict[int, Any] = {}
        self._seen: list[int] = []

    def hold(self) -> None:
        if threading.current_thread() is not threading.main_thread():
            # A generator that was left over is closed wherever it is found.
            return
        for number in (signal.SIGINT, signal.SIGTERM):
            handler = signal.getsignal(number)
            if callable(handler) and not isinstance(handler, signal.Handlers):
                self._before[number] = handler
                signal.signal(number, self._note)

    def release(self) -> None:
        """Hand the signals back, then what came meanwhile to those who handle it."""
        try:
            while self._before:
                number = next(iter(self._before))
                signal.signal(number, self._before[number])
                del self._before[number]
        finally:
            # One that comes now, with the other signal still to be handed back.
            if self._before:
                self.release()
        while self._seen:
            signal.raise_signal(self._seen.pop(0))

    def _note(self, number: int, frame: FrameType | None) -> None:
        if number not in self._seen:
            self._seen.append(number)


class _LetThrough:
    """Hands the signals back for a block.

    Not a generator: one that is cut as it begins is closed whenever it is found, and would take the
    signals over again then.
    """

    def __init__(self, held: _Held) -> None:
        self._held = held

    def __enter__(self) -> None:
        try:
            self._held.release()
        except BaseException:
            self._held.hold()
            raise

    def __exit__(self, *_: object) -> None:
        self._held.hold()
