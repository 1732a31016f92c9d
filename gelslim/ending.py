"""What Ctrl-C and SIGTERM do to `gelslim`, from its first line to its last.

Nothing is begun while the command line itself loads: the program says so and ends. Later a
KeyboardInterrupt is raised, so that whatever is open is closed and removed on the way out. It is
raised neither within the import of a library, which may crash or call itself missing, nor within
llvmlite, which would free memory twice, but after them. Whoever asks again meanwhile waits for
that, PATIENCE_S at most. An interrupted process ends without the teardown of the interpreter:
threads of compiled code may still be running, and would meet what is freed under them.
"""

from __future__ import annotations

import _thread
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

PATIENCE_S = 3.0
"""After the first signal or the end of the work; the next one then ends the process as it is."""
RETRY_S = 0.02
"""Between looks at whether an import or a call into llvmlite is over."""
SAID = {
    signal.SIGINT: ("interrupted", "Interrupted; every file that is there is whole."),
    signal.SIGTERM: ("terminated", "Terminated; every file that is there is whole."),
}
"""Kind, as in answers in JSON, and line for people."""
SHOWN_AGAIN = b"\r\x1b[2K\x1b[?25h"
"""Clears a progress bar's line on a terminal and shows the cursor that it has hidden."""
_IMPORTS = ("<frozen importlib._bootstrap>", "<frozen importlib._bootstrap_external>")
_LLVMLITE = os.sep.join(("", "llvmlite", "binding", ""))
"""In the paths of its modules. A line of Python after a call of LLVM notes who frees an object."""


class Terminated(KeyboardInterrupt):
    """SIGTERM, which ends a command as Ctrl-C does but for its status."""


class Ending:
    """One run of the program; `arm` it as early as can be, `begin` the work, `end` with a status.

    All of it lives in the main thread, where Python runs signal handlers.
    """

    def __init__(self) -> None:
        self._begun = False
        self._status: int | None = None
        self._since: float | None = None
        self._retrying = False
        self._leaving = False

    def arm(self) -> None:
        """Take both signals over where nobody has them ignored, as `nohup` and shells do."""
        for number in SAID:
            if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                signal.signal(number, self._asked)
        # The first to be registered is the last to run: only the interpreter's own end follows.
        atexit.register(_deafen)
        sys.excepthook = _but_for_interrupts(sys.excepthook)
        sys.unraisablehook = self._unraisable(sys.unraisablehook)
        threading.excepthook = self._in_thread(threading.excepthook)

    def begin(self) -> None:
        """From now on there may be something to close."""
        self._begun = True

    def end(self, status: int) -> int:
        """The work is done and said; a signal changes nothing any more. Returns `status`."""
        # In this order: a signal between the two must raise nothing any more.
        self._since = time.monotonic()
        self._status = status
        return status

    def leave(self, status: int) -> NoReturn:
        """End after an interrupt: run the exit functions, flush, and tear nothing down."""
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError, AttributeError):
                stream.flush()
        os._exit(status)

    def _asked(self, number: int, frame: FrameType | None) -> None:
        if self._since is not None:
            if time.monotonic() - self._since > PATIENCE_S:
                self._leave(number)
        elif not self._begun:
            self._leave(number)
        elif _not_to_be_cut(frame):
            self._ask_again(number)
        else:
            self._since = time.monotonic()
            raise KeyboardInterrupt if number == signal.SIGINT else Terminated

    def _leave(self, number: int) -> None:
        """End here and now; buffered streams may be in use, and are left alone."""
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
        if self._retrying:
            return
        self._retrying = True

        def later() -> None:
            if not at_once:
                time.sleep(RETRY_S)
            self._retrying = False
            send_to_main_thread(number)

        # Not threading.Thread: it takes locks that the code under this handler may hold.
        _thread.start_new_thread(later, ())

    def _unraisable(self, before: Callable[[Any], Any]) -> Callable[[Any], None]:
        def hook(told: Any) -> None:
            if isinstance(told.exc_value, KeyboardInterrupt) and self._status is None:
                # It fell into a destructor or compiled code, which swallow it.
                self._since = None
                self._ask_again(number_of(told.exc_value), at_once=True)
            elif self._since is None:
                before(told)

        return hook

    def _in_thread(self, before: Callable[[Any], Any]) -> Callable[[Any], None]:
        def hook(told: Any) -> None:
            # What a thread misses once its work is being taken down is no news.
            if self._since is None:
                before(told)

        return hook


def say(number: int) -> None:
    """The one line, or the answer in JSON to those who asked for one; past all buffers."""
    kind, line = SAID[signal.Signals(number)]
    text, descriptor = line, 2
    if "--json" in sys.argv[1:]:
        text, descriptor = f'{{\n  "error": "{kind}",\n  "message": "{line}"\n}}', 1
    with contextlib.suppress(OSError):
        os.write(descriptor, f"{text}\n".encode())


def send_to_main_thread(number: int) -> None:
    """Have the handler of a signal run; a wait of the main thread ends for it where it can."""
    thread = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and thread is not None:
        signal.pthread_kill(thread, number)
    else:
        _thread.interrupt_main(signal.Signals(number))


def asked_to_end(error: BaseException | None) -> int | None:
    """The signal behind an error: its own, or that of what it was raised from or amidst."""
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


def _but_for_interrupts(before: Callable[..., Any]) -> Callable[..., None]:
    """Cython prints what it swallows as if it had reached the top."""

    def hook(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        if not isinstance(error, KeyboardInterrupt):
            before(kind, error, trace)

    return hook


def number_of(error: BaseException) -> int:
    """The signal that a KeyboardInterrupt stands for."""
    return signal.SIGTERM if isinstance(error, Terminated) else signal.SIGINT


def _not_to_be_cut(frame: FrameType | None) -> bool:
    """Whether an import or a call into llvmlite is under way."""
    while frame is not None:
        file = frame.f_code.co_filename
        if file in _IMPORTS or _LLVMLITE in file:
            return True
        frame = frame.f_back
    return False


def _deafen() -> None:
    """The interpreter, as it ends, would hand the signals back to the system, which kills."""
    for number in SAID:
        signal.signal(number, signal.SIG_IGN)
