"""Worker processes that end with their parent, and at once when it is interrupted."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing.connection import wait
from types import FrameType
from typing import Any, Literal

from gelslim_core.files.held_interrupt import interrupts_held

_ENDING = (signal.SIGINT, signal.SIGTERM)
PATIENCE_S = 2
"""Given to workers that are told to end, before they are killed."""
TOLD = 128 + signal.SIGTERM
_at_work = False
"""Whether this worker is in the middle of a task."""


class _ToldToEnd(BaseException):
    """Closes what a worker has open; handlers of errors leave it alone."""


@contextlib.contextmanager
def worker_pool(workers: int, method: Literal["fork", "spawn"]) -> Iterator[ProcessPoolExecutor]:
    """A pool whose workers are gone when the block is left by an error, Ctrl-C included.

    Left without one it waits for what is still to do. Workers of a killed parent end too.
    """
    context = multiprocessing.get_context(method)
    with interrupts_held() as let_through:
        pool = _Pool(workers, mp_context=context, initializer=begin_worker)
        try:
            with let_through():
                yield pool
                pool.shutdown()
        except BaseException:
            _stop(pool)
            raise


class _Pool(ProcessPoolExecutor):
    """Its workers start with Ctrl-C and SIGTERM blocked, until `begin_worker` says what they do.

    A new interpreter would print a traceback until then, and a fork do what its parent does.
    """

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """As of any executor; no interrupt falls into the start of a worker."""
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
    """A task in a worker, which ends by SIGTERM once what the task has open is closed."""
    global _at_work
    try:
        _at_work = True
        return fn(*args, **kwargs)
    except _ToldToEnd:
        os._exit(TOLD)
    finally:
        _at_work = False


def _told(number: int, frame: FrameType | None) -> None:
    if not _at_work:
        os._exit(TOLD)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise _ToldToEnd


def begin_worker() -> None:
    """Make this process end with its parent, and leave Ctrl-C to it: the parent ends its workers.

    Otherwise workers of a killed parent wait for work for ever, as each holds the queue open.
    """
    with contextlib.suppress(ValueError):  # not in the main thread
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, _told)
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
    pool.shutdown(wait=False, cancel_futures=True)
    for process in processes:
        with contextlib.suppress(OSError, ValueError, AttributeError):
            process.terminate()
    deadline = time.monotonic() + PATIENCE_S
    for process in processes:
        with contextlib.suppress(OSError, ValueError, AssertionError):
            process.join(max(0.0, deadline - time.monotonic()))
            # In compiled code, which hears nothing until it returns.
            process.kill()
    for process in processes:
        with contextlib.suppress(OSError, ValueError, AssertionError):
            process.join()
