"""Results of finished tasks, one file each, so that a killed run can be continued."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gelslim_cad.build.folder import locked
from gelslim_cad.explore.axis import ExploreError
from gelslim_cad.explore.task import Task
from gelslim_core.files.replaced_file import is_part, replace_file, sweep

MARK, MARKED = "explore.json", b"{}\n"
CHUNKS = "chunks"


@dataclass(frozen=True)
class Store:
    """The folder of one exploration."""

    folder: Path

    @classmethod
    @contextlib.contextmanager
    def opened(cls, folder: Path) -> Iterator[Store]:
        """The store, locked against another run on the same folder, which waits.

        Raises ExploreError where the folder holds something else, OSError where it cannot be
        written.
        """
        target = Path(os.path.abspath(folder))
        with locked(target):
            occupied = target.exists() and (not target.is_dir() or _foreign(target))
            if occupied:
                raise ExploreError(
                    f"{folder} exists and holds no exploration; give another -o or remove it"
                )
            if not (target / MARK).exists():
                replace_file(target / MARK, MARKED, parents=True)
            (target / CHUNKS).mkdir(exist_ok=True)
            sweep(target, again=True)
            yield cls(target)

    def read(self, task: Task) -> dict[str, Any] | None:
        """The stored result; None where there is none or the file is damaged."""
        try:
            found = json.loads(self._place(task).read_bytes())
        except (OSError, ValueError):
            return None
        complete = isinstance(found, dict) and found.get("key") == task.key
        return found["result"] if complete else None

    def write(self, task: Task, result: dict[str, Any]) -> None:
        """Store a result in one step."""
        record = {"key": task.key, "result": result}
        replace_file(self._place(task), json.dumps(record, separators=(",", ":")).encode())

    def keep_only(self, tasks: Iterable[Task]) -> None:
        """Remove results of other tasks and what a killed run left half-written."""
        wanted = {self._place(t).name for t in tasks}
        for path in (self.folder / CHUNKS).iterdir():
            if path.name not in wanted:
                path.unlink(missing_ok=True)

    def _place(self, task: Task) -> Path:
        return self.folder / CHUNKS / f"{task.kind}-{task.key[:20]}.json"


def _foreign(folder: Path) -> bool:
    """Whether the folder holds files that no exploration wrote."""
    other_files = any(not is_part(path.name) for path in folder.iterdir())
    mark = folder / MARK
    return other_files and not (mark.is_file() and mark.read_bytes() == MARKED)
