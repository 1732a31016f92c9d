"""Tasks for workers on any machine: plain data in and out, with the same result everywhere.

Results of workers with other code are refused.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

from gelslim_cad.build.fingerprint import code_hash, combined
from gelslim_cad.explore.brightness import trace
from gelslim_cad.explore.force_error import Patch, patch_error
from gelslim_cad.explore.judge import judge
from gelslim_cad.explore.space import Axis, ExploreError
from gelslim_cad.spec import Spec
from gelslim_core.jobs import Engine, EngineError

Kind = Literal["designs", "light", "force"]


@dataclass(frozen=True)
class Task:
    """One piece of work; `payload` is canonical JSON, so tasks compare and hash by content."""

    kind: Kind
    payload: str

    @classmethod
    def of(cls, kind: Kind, content: dict[str, Any]) -> Task:
        """A task of plain content."""
        return cls(kind, json.dumps(content, sort_keys=True, separators=(",", ":")))

    @property
    def key(self) -> str:
        """Digest of the content and of the code and libraries that would do it."""
        return combined(code_hash(), self.kind, self.payload)


def perform(task: Task) -> dict[str, Any]:
    """Do a task on one thread. Raises what the model raises."""
    from threadpoolctl import threadpool_limits

    content = json.loads(task.payload)
    # One thread: the sums of more come in another order, and workers are processes already.
    with threadpool_limits(1):
        if task.kind == "designs":
            return _designs(content)
        if task.kind == "light":
            return {"traced": [asdict(trace(v, content["rays"])) for v in content["scenes"]]}
        return asdict(patch_error(Patch(**content)))


def _designs(content: dict[str, Any]) -> dict[str, Any]:
    axes = [Axis(path, tuple(values)) for path, values in content["axes"]]
    spec = Spec.model_validate_json(json.dumps(content["spec"]))
    rows = [tuple(row) for row in content["rows"]]
    columns = judge(spec, axes, rows, content["also"])
    return {"columns": {name: _packed(values) for name, values in columns.items()}}


def _packed(values: list[Any]) -> Any:
    """A column; where all its values are equal, only that value is kept."""
    alone = all(v == values[0] and type(v) is type(values[0]) for v in values)
    return {"all": values[0]} if alone else {"each": values}


def unpacked(packed: dict[str, Any], count: int) -> list[Any]:
    """The column that `_packed` was given."""
    if "all" in packed:
        return [packed["all"]] * count
    return list(packed["each"])


def run_tasks(engine: Engine, tasks: Sequence[Task]) -> Iterator[tuple[Task, dict[str, Any]]]:
    """Each task with its result, in the order they finish.

    Raises ExploreError where no cluster answers, its workers have other code, or a task kills
    its workers, and what a task raises.
    """
    here = code_hash()
    try:
        for number, (code, result) in engine.run(signed, tasks):
            if code != here:
                raise ExploreError(
                    f"--scheduler {engine.scheduler}: a worker has another version of "
                    "gelslim-cad or of its libraries than this machine; install the same there"
                )
            yield tasks[number], result
    except EngineError as error:
        raise ExploreError(f"{error}; what was finished is kept: run again") from error


def signed(task: Task) -> tuple[str, dict[str, Any]]:
    """A task's result with the digest of the code and libraries that gave it."""
    return code_hash(), perform(task)
