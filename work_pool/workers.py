"""Worker processes that end with their parent, and at once when it is interrupted."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing.connection import wait
from typing import Any, Literal

from whole_files.held_interrupt import interrupts_held

_ENDING = (signal.SIGINT, signal.SIGTERM)
PATIENCE_S = 5
"""Given to a worker that is told to end, before it is killed."""


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
            return super().submit(fn, *args, **kwargs)


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


def begin_worker() -> None:
    """Make this process end with its parent, and leave Ctrl-C to it: the parent ends its workers.

    Otherwise workers of a killed parent wait for work for ever, as each holds the queue open.
    """
    with contextlib.suppress(ValueError):  # not in the main thread
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
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
    for process in processes:
        with contextlib.suppress(OSError, ValueError, AssertionError):
            process.join(PATIENCE_S)
            process.kill()
