"""Ctrl-C held back over a stretch that must not be cut."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def interrupts_held() -> Iterator[None]:
    """Raise KeyboardInterrupt for a Ctrl-C at the end of the block, not within.

    Libraries of compiled code crash, or say that they are not installed, where it falls into
    their start. In another thread than the main one, which gets no Ctrl-C, nothing is held.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    seen: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: seen.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before if before is not None else signal.SIG_DFL)
    if seen and before is not signal.SIG_IGN:
        raise KeyboardInterrupt
