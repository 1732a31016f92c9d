"""Independent tasks on the workers of a Dask cluster."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

from gelslim_core.errors import GelslimError
from gelslim_core.optional_library import load

Task = TypeVar("Task")
Result = TypeVar("Result")
MAX_CRASHES = 3
"""Crashes of a worker during the same task after which the task is given up."""


class EngineError(GelslimError, ValueError):
    """Tasks cannot be started, or one of them crashes its workers; the message says why.

    Attributes:
        exit_status: 2, as for all input that cannot be used.
        kind: `bad input`.
    """


def on_cluster(
    perform: Callable[[Task], Result],
    tasks: Sequence[Task],
    address: str,
    tasks_per_worker: int,
    connect_s: float,
) -> Iterator[tuple[int, Result]]:
    """Run all tasks on a cluster.

    Args:
        perform: Function at the top level of a module.
        tasks: Its arguments.
        address: Of the scheduler.
        tasks_per_worker: Tasks that are submitted at one time for each thread of the workers, so
            that the scheduler does not hold them all.
        connect_s: How long to wait for the scheduler.

    Yields:
        The number of each task with its result, in the order in which they finish.

    Raises:
        EngineError: No cluster answers, or it has no workers.
        MissingLibraryError: The extra `cluster` is not installed.
    """
    with _client(address, connect_s) as (distributed, client):
        done = distributed.as_completed()
        running: dict[Any, int] = {}
        waiting = iter(range(len(tasks)))
        while True:
            most = tasks_per_worker * max(1, sum(client.nthreads().values()))
            for number in itertools.islice(waiting, max(0, most - len(running))):
                future = client.submit(perform, tasks[number], pure=False, retries=MAX_CRASHES)
                running[future] = number
                done.add(future)
            if not running:
                return
            future = next(done)
            yield running.pop(future), future.result()


@contextmanager
def warmed(ready: Callable[[], object], address: str, connect_s: float) -> Iterator[None]:
    """Let every worker of a cluster call a function while the block does something else.

    Args:
        ready: Function at the top level of a module. What it raises stays with the worker.
        address: Of the scheduler.
        connect_s: How long to wait for the scheduler.

    Raises:
        EngineError: No cluster answers, or it has no workers.
        MissingLibraryError: The extra `cluster` is not installed.
    """
    with _client(address, connect_s) as (_, client):
        called = [client.submit(ready, workers=[name], pure=False) for name in client.nthreads()]
        yield
        del called


@contextmanager
def _client(address: str, connect_s: float) -> Iterator[tuple[Any, Any]]:
    """The library, and a client of a cluster that has workers."""
    distributed = load("distributed", "--scheduler")
    try:
        client = distributed.Client(address, timeout=connect_s, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise EngineError(
            f"--scheduler {address}: no Dask scheduler answers within {connect_s} s ({error}); "
            "start one with `dask scheduler` and workers with `dask worker ADDRESS`"
        ) from error
    with client, client.as_current():
        if not client.scheduler_info()["workers"]:
            raise EngineError(
                f"--scheduler {address}: the cluster has no workers; start some with "
                f"`dask worker {address}` where gelslim-cad is installed"
            )
        yield distributed, client
