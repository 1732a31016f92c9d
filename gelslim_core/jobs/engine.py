"""Run independent tasks in this process, in other processes, or on a Dask cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    Executor,
    Future,
    as_completed,
)
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import TypeVar

from gelslim_core.errors import GelslimError
from gelslim_core.jobs.workers import worker_pool

Task = TypeVar("Task")
Result = TypeVar("Result")
CONNECT_S = 10
TASKS_PER_WORKER = 4
"""Tasks submitted at one time, per worker; tasks that are not yet submitted can be dropped."""
MAX_CRASHES = 3
"""Crashes of a worker during the same task after which the task is given up."""


class EngineError(GelslimError, ValueError):
    """Tasks cannot be started, or one of them crashes its workers; the message says why."""


@dataclass(frozen=True)
class Engine:
    """Runs tasks in `jobs` processes of this machine, or on the workers of a Dask scheduler.

    Attributes:
        jobs: Number of processes; 1 runs the tasks in this process.
        scheduler: Address of the Dask scheduler; empty for this machine.
    """

    jobs: int = 1
    scheduler: str = ""

    def run(
        self, perform: Callable[[Task], Result], tasks: Sequence[Task]
    ) -> Iterator[tuple[int, Result]]:
        """Run all tasks. A task whose worker crashes is run again.

        Args:
            perform: Function at the top level of a module; its argument and its result can be
                pickled.
            tasks: Its arguments.

        Yields:
            The number of each task with its result, in the order in which they finish.

        Raises:
            EngineError: No cluster answers, or a task has crashed its worker three times.
                Exceptions that a task raises are raised as they are.
        """
        if self.scheduler:
            yield from _on_cluster(perform, tasks, self.scheduler)
        elif self.jobs == 1 or len(tasks) < 2:
            for number, task in enumerate(tasks):
                yield number, perform(task)
        else:
            yield from _in_pools(perform, tasks, min(self.jobs, len(tasks)))


def processors() -> int:
    """Number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _in_pools(
    perform: Callable[[Task], Result], tasks: Sequence[Task], workers: int
) -> Iterator[tuple[int, Result]]:
    """Run the tasks in a pool; after a crash run those that are left in a new pool."""
    left = list(range(len(tasks)))
    crashes: dict[int, int] = {}
    while left:
        suspects: list[int] = []
        # New processes, not forks, because numerical libraries have started threads by now.
        with worker_pool(workers, "spawn") as pool:
            for number, result in _in_pool(pool, perform, tasks, left, workers, suspects):
                yield number, result
        for number in suspects:
            crashes[number] = crashes.get(number, 0) + 1
            if crashes[number] >= MAX_CRASHES:
                raise EngineError(
                    f"task {number} was running each of the {MAX_CRASHES} times that a worker "
                    "crashed, perhaps for lack of memory; use fewer jobs"
                )
        if suspects:
            # One worker from now on, so that only the task that crashes is suspected again.
            workers = 1


def _in_pool(
    pool: Executor,
    perform: Callable[[Task], Result],
    tasks: Sequence[Task],
    left: list[int],
    workers: int,
    suspects: list[int],
) -> Iterator[tuple[int, Result]]:
    """Run the tasks that are `left`; those that were running at a crash become `suspects`."""
    waiting = list(reversed(left))
    running: dict[Future[Result], int] = {}
    try:
        while waiting or running:
            while waiting and len(running) < TASKS_PER_WORKER * workers:
                number = waiting.pop()
                running[pool.submit(perform, tasks[number])] = number
            done = next(as_completed(running))
            result = done.result()
            number = running.pop(done)
            left.remove(number)
            yield number, result
    except BrokenProcessPool:
        suspects.extend(sorted(running.values())[:workers])
    finally:
        for future in running:
            future.cancel()


def _on_cluster(
    perform: Callable[[Task], Result], tasks: Sequence[Task], address: str
) -> Iterator[tuple[int, Result]]:
    try:
        from distributed import Client
        from distributed import as_completed as as_finished
    except ImportError as error:
        raise EngineError(
            "--scheduler needs distributed, which is not installed; "
            "run: pip install 'gelslim-cad[cluster]'"
        ) from error
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise EngineError(
            f"--scheduler {address}: no Dask scheduler answers within {CONNECT_S} s ({error}); "
            "start one with `dask scheduler` and workers with `dask worker ADDRESS`"
        ) from error
    with client, client.as_current():
        if not client.scheduler_info()["workers"]:
            raise EngineError(
                f"--scheduler {address}: the cluster has no workers; start some with "
                f"`dask worker {address}` where gelslim-cad is installed"
            )
        futures = {
            client.submit(perform, task, pure=False, retries=MAX_CRASHES): number
            for number, task in enumerate(tasks)
        }
        for future in as_finished(list(futures)):
            yield futures[future], future.result()
