"""Run independent tasks in this process, in other processes, or on a Dask cluster."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import TypeVar

from gelslim_core.cluster import MAX_CRASHES, EngineError, on_cluster, warmed
from gelslim_core.worker_pool import worker_pool

Task = TypeVar("Task")
Result = TypeVar("Result")
CONNECT_S = 10
TASKS_PER_WORKER = 4
"""Tasks submitted at one time, per worker; tasks that are not yet submitted can be dropped."""


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
            MissingLibraryError: There is a scheduler, but the extra `cluster` is not installed.
        """
        if self.scheduler:
            yield from on_cluster(perform, tasks, self.scheduler, TASKS_PER_WORKER, CONNECT_S)
        elif self.jobs == 1 or len(tasks) < 2:
            for number, task in enumerate(tasks):
                yield number, perform(task)
        else:
            yield from _in_pools(perform, tasks, min(self.jobs, len(tasks)))

    @contextlib.contextmanager
    def warmed(self, ready: Callable[[], object]) -> Iterator[None]:
        """Let the workers of a cluster get ready while the block finds out what they shall do.

        Args:
            ready: Function at the top level of a module, such as one that imports libraries.
                Without a scheduler it is not called, because there are no workers yet.

        Raises:
            EngineError: No cluster answers; so this is known before the work of the block.
            MissingLibraryError: There is a scheduler, but the extra `cluster` is not installed.
        """
        if not self.scheduler:
            yield
            return
        with warmed(ready, self.scheduler, CONNECT_S):
            yield

    def require_main(self) -> None:
        """Refuse to start processes from a script that a worker process is importing.

        Raises:
            EngineError: The script starts its work on import. Its workers would do all of it
                again, or wait for ever for a folder that it has locked.
        """
        importing = getattr(multiprocessing.current_process(), "_inheriting", False)
        if importing and self.jobs > 1 and not self.scheduler:
            raise EngineError(
                "worker processes import your script again, so its work must stand below "
                '`if __name__ == "__main__":`; or use one job'
            )


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
