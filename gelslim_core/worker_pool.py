"""A pool of worker processes that end with their parent, and at once when it is interrupted."""

from __future__ import annotations

import contextlib
import gc
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing.connection import wait
from types import FrameType
from typing import Any, Literal

from gelslim_core.files.held_interrupt import (
    RETRY_S,
    interrupts_held,
    must_not_be_interrupted,
    repeat_signal,
)

_ENDING = (signal.SIGINT, signal.SIGTERM)
GRACE_S = 2
"""Time for workers to end after SIGTERM, before they are killed."""
TERMINATED = 128 + signal.SIGTERM
"""Exit status of a worker that SIGTERM ended."""
HOOK = "swallowed"
"""Name of the hook for exceptions that could not be raised."""
_is_busy = False
"""Whether this worker is running a task."""
_calls = 0
"""How often this worker has handled SIGTERM."""
_unwinds = False
"""Whether a signal has interrupted the task, so that further ones change nothing."""


class _Terminated(BaseException):
    """Unwinds a task so that its files are closed; no `except Exception` catches it."""


@contextlib.contextmanager
def worker_pool(workers: int, method: Literal["fork", "spawn"]) -> Iterator[ProcessPoolExecutor]:
    """A pool of processes whose workers are ended when an exception leaves the block.

    Ctrl-C is such an exception. Without an exception the end of the block waits for the tasks
    that are left. Workers also end when their parent is killed.
    """
    context = multiprocessing.get_context(method)
    with interrupts_held() as let_through, _shared_objects(method):
        pool = _Pool(workers, mp_context=context, initializer=begin_worker)
        try:
            with let_through():
                yield pool
                pool.shutdown()
        except BaseException:
            _stop(pool)
            raise


@contextlib.contextmanager
def _shared_objects(method: str) -> Iterator[None]:
    """Keep the garbage collector off the objects that forked workers share with this process.

    It would write to each of them, so that every worker gets a copy of their memory. A program that
    has frozen its objects keeps them so.
    """
    freezes = method == "fork" and gc.get_freeze_count() == 0
    if freezes:
        gc.freeze()
    try:
        yield
    finally:
        if freezes:
            gc.unfreeze()


class _Pool(ProcessPoolExecutor):
    """Starts its workers with SIGINT and SIGTERM blocked until `begin_worker` handles them.

    Before that a new interpreter would print a traceback, and a fork would run the handler of
    its parent.
    """

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Submit a task; no interrupt reaches a worker while it starts."""
        with interrupts_held(), _blocked():
            return super().submit(_perform, fn, *args, **kwargs)


@contextlib.contextmanager
def _blocked() -> Iterator[None]:
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _perform(fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Any:
    """Run a task in a worker, which ends on SIGTERM after the task has closed its files."""
    global _is_busy
    try:
        _is_busy = True
        return fn(*args, **kwargs)
    except _Terminated:
        os._exit(TERMINATED)
    finally:
        _is_busy = False


def _terminate(number: int, frame: FrameType | None) -> None:
    global _calls, _unwinds
    _calls += 1
    if not _is_busy:
        os._exit(TERMINATED)
    # The handler stays in place: Python reports a signal that arrives while it is replaced.
    if _unwinds:
        return
    if must_not_be_interrupted(frame) or _is_told(frame):
        _terminate_soon()
        return
    _unwinds = True
    raise _Terminated


def _is_told(frame: FrameType | None) -> bool:
    """Whether the hook for a swallowed exception runs in a frame or its callers.

    An exception that it raised would be printed, and nothing else.
    """
    while frame is not None:
        if (frame.f_code.co_filename, frame.f_code.co_name) == (__file__, HOOK):
            return True
        frame = frame.f_back
    return False


def _terminate_soon() -> None:
    calls = _calls
    repeat_signal(signal.SIGTERM, lambda: _calls != calls, RETRY_S)


def _unraisable(before: Callable[[Any], Any]) -> Callable[[Any], None]:
    def swallowed(raised: Any) -> None:
        global _unwinds
        if isinstance(raised.exc_value, _Terminated):
            # A destructor or compiled code was interrupted and swallowed the exception.
            _unwinds = False
            _terminate_soon()
        else:
            before(raised)

    return swallowed


def _uncaught(kind: type[BaseException], value: BaseException, trace: Any) -> None:
    # Compiled code prints an exception before it swallows it.
    if not isinstance(value, _Terminated):
        sys.__excepthook__(kind, value, trace)


def begin_worker() -> None:
    """Make this process end with its parent, and ignore Ctrl-C.

    On Ctrl-C the parent ends its workers. Without this the workers of a killed parent would wait
    for ever, as each of them holds the queue open.
    """
    with contextlib.suppress(ValueError):  # raised outside the main thread
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, _terminate)
        sys.unraisablehook = _unraisable(sys.unraisablehook)
        sys.excepthook = _uncaught
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)


def _stop(pool: ProcessPoolExecutor) -> None:
    # The executor has no public way to end its workers before Python 3.14.
    processes = list((getattr(pool, "_processes", None) or {}).values())
    manager = getattr(pool, "_executor_manager_thread", None)
    pool.shutdown(wait=False, cancel_futures=True)
    for process in processes:
        with contextlib.suppress(OSError, ValueError, AttributeError):
            process.terminate()
    deadline = time.monotonic() + GRACE_S
    for process in processes:
        with contextlib.suppress(OSError, ValueError, AssertionError):
            process.join(max(0.0, deadline - time.monotonic()))
            # A worker in compiled code handles no signal until that code returns.
            process.kill()
    for process in processes:
        with contextlib.suppress(OSError, ValueError, AssertionError):
            process.join()
    if manager is not None:
        # It frees the pool's semaphores. A process that ends meanwhile would leave one behind.
        manager.join(GRACE_S)
