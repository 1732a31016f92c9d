"""Where tasks are done: here, in processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any

from gelslim_cad.build.fingerprint import code_hash
from gelslim_cad.explore.error import ExploreError
from gelslim_cad.explore.task import Task, perform

CONNECT_S = 10
AHEAD = 4
"""Tasks handed out per worker: results are stored as they come, the rest can still be dropped."""


@dataclass(frozen=True)
class Engine:
    """`jobs` processes here, or the workers behind the Dask scheduler at `scheduler`."""

    jobs: int = 1
    scheduler: str = ""

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, dict[str, Any]]]:
        """Each task with its result, in the order they finish.

        Raises ExploreError where no cluster answers, its workers have other code, or a process is
        killed, and what a task raises.
        """
        if self.scheduler:
            yield from _on_cluster(tasks, self.scheduler)
        elif self.jobs == 1 or len(tasks) < 2:
            for task in tasks:
                yield task, perform(task)
        else:
            # Fresh processes, not forks: numeric libraries have started threads by now.
            context = multiprocessing.get_context("spawn")
            workers = min(self.jobs, len(tasks))
            with ProcessPoolExecutor(workers, mp_context=context) as pool:
                try:
                    yield from _in_pool(pool, tasks, workers)
                except BrokenProcessPool as error:
                    raise ExploreError(
                        "a worker process was ended from outside, perhaps for want of memory; "
                        "what was finished is kept: run again, with fewer --jobs"
                    ) from error


def processors() -> int:
    """Processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _in_pool(
    pool: Executor, tasks: Sequence[Task], workers: int
) -> Iterator[tuple[Task, dict[str, Any]]]:
    waiting = list(reversed(tasks))
    running: dict[Future[dict[str, Any]], Task] = {}
    try:
        while waiting or running:
            while waiting and len(running) < AHEAD * workers:
                task = waiting.pop()
                running[pool.submit(perform, task)] = task
            done = next(as_completed(running))
            yield running.pop(done), done.result()
    finally:
        for future in running:
            future.cancel()


def _on_cluster(tasks: Sequence[Task], address: str) -> Iterator[tuple[Task, dict[str, Any]]]:
    try:
        from distributed import Client
        from distributed import as_completed as as_finished
    except ImportError as error:
        raise ExploreError(
            "--scheduler needs distributed, which is not installed; "
            "run: pip install 'gelslim-cad[cluster]'"
        ) from error
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise ExploreError(
            f"--scheduler {address}: no Dask scheduler answers within {CONNECT_S} s ({error}); "
            "start one with `dask scheduler` and workers with `dask worker ADDRESS`"
        ) from error
    with client, client.as_current():
        if not client.scheduler_info()["workers"]:
            raise ExploreError(
                f"--scheduler {address}: the cluster has no workers; start some with "
                f"`dask worker {address}` where gelslim-cad is installed"
            )
        futures = {client.submit(signed, t, pure=False): t for t in tasks}
        for future in as_finished(list(futures)):
            code, result = future.result()
            if code != code_hash():
                raise ExploreError(
                    f"--scheduler {address}: a worker has another version of gelslim-cad or of its "
                    "libraries than this machine; install the same there"
                )
            yield futures[future], result


def signed(task: Task) -> tuple[str, dict[str, Any]]:
    """A task's result with the digest of the code and libraries that gave it."""
    return code_hash(), perform(task)
