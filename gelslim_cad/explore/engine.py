"""Runs the tasks of an exploration; results of workers with other code are refused."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from gelslim_cad.build.fingerprint import code_hash
from gelslim_cad.explore.axis import ExploreError
from gelslim_cad.explore.task import Task, perform
from gelslim_core.jobs import Engine as WorkEngine
from gelslim_core.jobs import EngineError, processors

__all__ = ["Engine", "processors"]


@dataclass(frozen=True)
class Engine:
    """`jobs` processes here, or the workers behind the Dask scheduler at `scheduler`."""

    jobs: int = 1
    scheduler: str = ""

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, dict[str, Any]]]:
        """Each task with its result, in the order they finish.

        Raises ExploreError where no cluster answers, its workers have other code, or a task kills
        its workers, and what a task raises.
        """
        here = code_hash()
        try:
            for number, (code, result) in WorkEngine(self.jobs, self.scheduler).run(signed, tasks):
                if code != here:
                    raise ExploreError(
                        f"--scheduler {self.scheduler}: a worker has another version of "
                        "gelslim-cad or of its libraries than this machine; install the same there"
                    )
                yield tasks[number], result
        except EngineError as error:
            raise ExploreError(f"{error}; what was finished is kept: run again") from error


def signed(task: Task) -> tuple[str, dict[str, Any]]:
    """A task's result with the digest of the code and libraries that gave it."""
    return code_hash(), perform(task)
