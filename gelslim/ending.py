"""How `gelslim` ends on Ctrl-C and SIGTERM, from its first line to its last.

While the command line itself loads, there is nothing to clean up: the program prints a line and
ends. Later a KeyboardInterrupt is raised, so that open files are closed and temporary files are
removed. It is not raised during the import of a library, which could crash or report that it is
missing, nor during a call of llvmlite, which would free memory twice, but directly after them. A
further signal waits for that, at most PATIENCE_S. The process ends without the teardown of the
interpreter: threads of compiled code that an interrupt left running would use freed memory, and
after a build the teardown would take a second.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any, NoReturn

from gelslim_core.files.held_interrupt import (
    RETRY_S,
    must_not_be_interrupted,
    repeat_signal,
)

PATIENCE_S = 3.0
"""Time after the first signal, or after the work, from which a signal ends the process at once."""
SAID = {
    signal.SIGINT: ("interrupted", "Interrupted; every file that is there is whole."),
    signal.SIGTERM: ("terminated", "Terminated; every file that is there is whole."),
}
"""Kind of the error in JSON, and the line that people read."""
SHOWN_AGAIN = b"\r\x1b[2K\x1b[?25h"
"""Clears the line of a progress bar on a terminal and shows the cursor that it has hidden."""


class Terminated(KeyboardInterrupt):
    """SIGTERM, which ends a command as Ctrl-C does, with another exit status."""


class Ending:
    """One run of the program: `arm` it as early as possible, `begin` the work, `end` with a status.

    All methods run in the main thread, where Python runs signal handlers.
    """

    def __init__(self) -> None:
        self._begun = False
        self._status: int | None = None
        self._since: float | None = None
        # How often the handler was called, and the call after which the signal is being repeated.
        self._calls = 0
        self._repeated_after = -1
        self._leaving = False

    def arm(self) -> None:
        """Handle both signals, unless the caller ignores them, as `nohup` does."""
        for number in SAID:
            if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                signal.signal(number, self._asked)
        # The function that is registered first runs last, directly before the interpreter ends.
        atexit.register(_ignore_signals)
        sys.excepthook = _without_interrupts(sys.excepthook)
        sys.unraisablehook = self._unraisable(sys.unraisablehook)
        threading.excepthook = self._in_thread(threading.excepthook)

    def begin(self) -> None:
        """From now on there may be something to clean up."""
        self._begun = True

    def end(self, status: int) -> int:
        """The work is done and reported; a signal changes nothing any more. Returns `status`."""
        # The time is set first, so that a signal between the two lines raises nothing.
        self._since = time.monotonic()
        self._status = status
        return status

    def wait_for_threads(self) -> None:
        """Wait for all threads but daemons, as the interpreter does before it ends."""
        for thread in threading.enumerate():
            if thread is not threading.main_thread() and not thread.daemon:
                thread.join()

    def leave(self, status: int) -> NoReturn:
        """End the process: run the exit functions and flush, without further teardown."""
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError, AttributeError):
                stream.flush()
        os._exit(status)

    def _asked(self, number: int, frame: FrameType | None) -> None:
        self._calls += 1
        if self._since is not None:
            if time.monotonic() - self._since > PATIENCE_S:
                self._leave(number)
        elif not self._begun:
            self._leave(number)
        elif must_not_be_interrupted(frame):
            self._ask_again(number)
        else:
            self._since = time.monotonic()
            raise KeyboardInterrupt if number == signal.SIGINT else Terminated

    def _leave(self, number: int) -> None:
        """End at once. Buffered streams may be in use, so they are not flushed."""
        if self._leaving:
            return
        self._leaving = True
        status = self._status
        if status is None:
            status = 128 + number
            with contextlib.suppress(OSError):
                if self._begun and os.isatty(2):
                    os.write(2, SHOWN_AGAIN)
            say(number)
        os._exit(status)

    def _ask_again(self, number: int, at_once: bool = False) -> None:
        calls = self._calls
        if self._repeated_after == calls:
            return
        self._repeated_after = calls
        repeat_signal(number, lambda: self._calls != calls, 0.0 if at_once else RETRY_S)

    def _unraisable(self, before: Callable[[Any], Any]) -> Callable[[Any], None]:
        def hook(raised: Any) -> None:
            if isinstance(raised.exc_value, KeyboardInterrupt) and self._status is None:
                # A destructor or compiled code was interrupted and swallowed the exception.
                self._since = None
                self._ask_again(number_of(raised.exc_value), at_once=True)
            elif self._since is None:
                before(raised)

        return hook

    def _in_thread(self, before: Callable[[Any], Any]) -> Callable[[Any], None]:
        def hook(raised: Any) -> None:
            # Errors of threads are of no interest while the program ends.
            if self._since is None:
                before(raised)

        return hook


def say(number: int) -> None:
    """Print the line, or with `--json` the answer in JSON, without any buffer."""
    kind, line = SAID[signal.Signals(number)]
    text, descriptor = line, 2
    if "--json" in sys.argv[1:]:
        text, descriptor = f'{{\n  "error": "{kind}",\n  "message": "{line}"\n}}', 1
    with contextlib.suppress(OSError):
        os.write(descriptor, f"{text}\n".encode())


def asked_to_end(error: BaseException | None) -> int | None:
    """The signal that caused an error, directly or through its cause or context; else None."""
    seen: set[int] = set()
    todo = [error]
    while todo:
        error = todo.pop()
        if error is None or id(error) in seen:
            continue
        seen.add(id(error))
        if isinstance(error, KeyboardInterrupt):
            return number_of(error)
        todo += [error.__cause__, error.__context__]
    return None


def _without_interrupts(before: Callable[..., Any]) -> Callable[..., None]:
    """Cython prints exceptions that it swallows as if nobody had caught them."""

    def hook(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        if not isinstance(error, KeyboardInterrupt):
            before(kind, error, trace)

    return hook


def number_of(error: BaseException) -> int:
    """The signal that a KeyboardInterrupt stands for."""
    return signal.SIGTERM if isinstance(error, Terminated) else signal.SIGINT


def _ignore_signals() -> None:
    """Ignore both signals; the ending interpreter would restore handlers that kill the process."""
    for number in SAID:
        signal.signal(number, signal.SIG_IGN)
