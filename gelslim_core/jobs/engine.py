"""Where tasks are done: here, in processes of this machine, or on a Dask cluster."""

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
AHEAD = 4
"""Tasks handed out per worker: results are taken as they come, the rest can still be dropped."""
MOST_DEATHS = 3
"""Times that a worker may die over the same task before the task is given up."""


class EngineError(GelslimError, ValueError):
    """Tasks cannot be handed out, or one of them kills its workers; the message says why."""


@dataclass(frozen=True)
class Engine:
    """`jobs` processes here, or the workers behind the Dask scheduler at `scheduler`."""

    jobs: int = 1
    scheduler: str = ""

    def run(
        self, perform: Callable[[Task], Result], tasks: Sequence[Task]
    ) -> Iterator[tuple[int, Result]]:
        """Number of each task with its result, in the order they finish.

        `perform` is a function of a module; its argument and result can be pickled. A task whose
        worker dies is done again. Raises EngineError where no cluster answers or a task has
        killed three workers, and what a task raises.
        """
        if self.scheduler:
            yield from _on_cluster(perform, tasks, self.scheduler)
        elif self.jobs == 1 or len(tasks) < 2:
            for number, task in enumerate(tasks):
                yield number, perform(task)
        else:
            yield from _in_pools(perform, tasks, min(self.jobs, len(tasks)))


def processors() -> int:
    """Processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _in_pools(
    perform: Callable[[Task], Result], tasks: Sequence[Task], workers: int
) -> Iterator[tuple[int, Result]]:
    """A pool, and another one for what is left whenever a worker dies."""
    left = list(range(len(tasks)))
    deaths: dict[int, int] = {}
    while left:
        suspects: list[int] = []
        # Fresh processes, not forks: numeric libraries have started threads by now.
        with worker_pool(workers, "spawn") as pool:
            for number, result in _in_pool(pool, perform, tasks, left, workers, suspects):
                yield number, result
        for number in suspects:
            deaths[number] = deaths.get(number, 0) + 1
            if deaths[number] >= MOST_DEATHS:
                raise EngineError(
                    f"task {number} was in hand each of the {MOST_DEATHS} times that a worker "
                    "died: too little memory, perhaps; use fewer jobs"
                )
        if suspects:
            # Next time one by one: only the task that kills is then blamed again.
            workers = 1


def _in_pool(
    pool: Executor,
    perform: Callable[[Task], Result],
    tasks: Sequence[Task],
    left: list[int],
    workers: int,
    suspects: list[int],
) -> Iterator[tuple[int, Result]]:
    """Do what is `left`, taking off what is done; what was in hand as a worker died is suspect."""
    waiting = list(reversed(left))
    running: dict[Future[Result], int] = {}
    try:
        while waiting or running:
            while waiting and len(running) < AHEAD * workers:
                number = waiting.pop()
                running[pool.submit(perform, tasks[number])] = number
            done = next(as_completed(running))
            result = done.result()
            number = running.pop(done)
            left.remove(number)
            yield number, result
    except BrokenProcessPool:
        in_hand = sorted(running.values())
        suspects.extend(in_hand[:workers])
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
            client.submit(perform, task, pure=False, retries=MOST_DEATHS): number
            for number, task in enumerate(tasks)
        }
        for future in as_finished(list(futures)):
            yield futures[future], future.result()
