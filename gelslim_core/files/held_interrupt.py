"""Ctrl-C and SIGTERM deferred while code runs that must not be interrupted."""

from __future__ import annotations

import _thread
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import FrameType
from typing import Any

RETRY_S = 0.02
"""Time between checks whether an import or a call of llvmlite has ended."""
_IMPORTS = ("<frozen importlib._bootstrap>", "<frozen importlib._bootstrap_external>")
_LLVMLITE = os.sep.join(("", "llvmlite", "binding", ""))
"""Part of the paths of its modules, which record in Python who must free an object of LLVM."""
LetThrough = Callable[[], AbstractContextManager[None]]


@contextmanager
def interrupts_held() -> Iterator[LetThrough]:
    """Let Ctrl-C and SIGTERM take effect at the end of the block instead of inside it.

    The value makes inner blocks in which both take effect at once. What is made before such a block
    and removed after it is therefore removed whenever a signal arrives. Libraries of compiled code
    crash, or report that they are not installed, if they are interrupted while they start.

    Signals that no Python code handles are left alone. Only the main thread receives Ctrl-C, so
    nothing is deferred in other threads.
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
    """The deferred signals, with their handlers before."""

    def __init__(self) -> None:
        self._before: dict[int, Any] = {}
        self._seen: list[int] = []

    def hold(self) -> None:
        if threading.current_thread() is not threading.main_thread():
            # Python may close an abandoned generator in any thread.
            return
        for number in (signal.SIGINT, signal.SIGTERM):
            handler = signal.getsignal(number)
            if callable(handler) and not isinstance(handler, signal.Handlers):
                self._before[number] = handler
                signal.signal(number, self._note)

    def release(self) -> None:
        """Restore the handlers, then raise the signals that arrived meanwhile."""
        try:
            while self._before:
                number = next(iter(self._before))
                signal.signal(number, self._before[number])
                del self._before[number]
        finally:
            # A signal arrived while the other handler was not yet restored.
            if self._before:
                self.release()
        while self._seen:
            signal.raise_signal(self._seen.pop(0))

    def _note(self, number: int, frame: FrameType | None) -> None:
        if number not in self._seen:
            self._seen.append(number)


class _LetThrough:
    """Restores the handlers for a block.

    It is no generator, because a generator that is interrupted as it begins would be closed at any
    later time, and would then defer the signals again.
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


def must_not_be_interrupted(frame: FrameType | None) -> bool:
    """Whether an import or a call of llvmlite is in progress in a frame or its callers.

    An import that is interrupted could crash or report that a library is missing; an interrupted
    call of llvmlite would free memory twice.
    """
    while frame is not None:
        file = frame.f_code.co_filename
        if file in _IMPORTS or _LLVMLITE in file:
            return True
        frame = frame.f_back
    return False


def repeat_signal(number: int, until: Callable[[], bool], after_s: float = 0.0) -> None:
    """From a thread of its own, run the handler of a signal in the main thread.

    A signal directly before a blocking call would not end that call, so it is repeated.

    Args:
        number: Signal.
        until: Whether the handler was called.
        after_s: Time before the first signal.
    """

    def repeat() -> None:
        time.sleep(after_s)
        while not until():
            send_to_main_thread(number)
            time.sleep(RETRY_S)

    # threading.Thread would take locks that the interrupted code may hold.
    _thread.start_new_thread(repeat, ())


def send_to_main_thread(number: int) -> None:
    """Run the handler of a signal in the main thread, and end its wait where that is possible."""
    thread = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and thread is not None:
        signal.pthread_kill(thread, number)
    else:
        _thread.interrupt_main(signal.Signals(number))
