"""An exploration from its request to its table; finished tasks are stored, one file each."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from gelslim_cad.build.folder import locked
from gelslim_cad.dimensions.dimensions import PATHS
from gelslim_cad.dimensions.registry import REGISTRY
from gelslim_cad.explore.brightness import RAYS, TRACED, Traced, light_columns
from gelslim_cad.explore.force_error import MARKER_NOISE_PX, Patch, PatchError
from gelslim_cad.explore.judge import SHOWN, VERDICT
from gelslim_cad.explore.space import ExploreError, Space
from gelslim_cad.explore.task import Task, run_tasks, unpacked
from gelslim_cad.geometry.lookup import NamedValues
from gelslim_cad.sensor import NoMarkersError
from gelslim_cad.spec.reader import suggestion
from gelslim_core.files.replaced_file import is_part, replace_file, sweep
from gelslim_core.jobs import Engine

Progress = Callable[[str, int, int], None]
SCENES = 16
"""Scenes per task of light."""
LIGHT_COLUMNS = (
    "light.on_coat",
    "light.irradiance_uw_mm2",
    "light.exposure_ms",
    "light.frame_rate_hz",
)
FORCE_COLUMNS = (
    "force.mesh_error",
    "force.noise_error",
    "force.error",
    "gel.stiffness_n_mm",
)
MARK, MARKED = "explore.json", b"{}\n"
CHUNKS = "chunks"


@dataclass(frozen=True)
class Request:
    """What to explore and which columns to add to dimensions and rules."""

    space: Space
    light: bool = False
    force_error: bool = False
    also: tuple[str, ...] = ()
    rays: int = RAYS
    noise_px: float = MARKER_NOISE_PX

    def __post_init__(self) -> None:
        object.__setattr__(self, "also", tuple(map(_column, self.also)))


def _column(name: str) -> str:
    """A dimension or spec field by its full name; the `design.` may be left out, as of an axis."""
    names = [*(e.name for e in REGISTRY.values() if not e.internal), *PATHS.values()]
    for full in (name, f"design.{name}"):
        if full in names:
            return full
    hint = suggestion(name, names, "`gelslim derive` lists dimensions")
    raise ExploreError(f"no dimension or spec field is called {name}; {hint}")


@dataclass(frozen=True)
class Exploration:
    """The table, columns by name in order, each a list over designs; tasks done and taken over."""

    space: Space
    columns: Mapping[str, list[Any]]
    done: int
    taken_over: int

    def rows_where(self, status: str) -> list[int]:
        """Designs of a status."""
        return [k for k, s in enumerate(self.columns["status"]) if s == status]


def explore(
    request: Request, folder: Path, engine: Engine, progress: Progress | None = None
) -> Exploration:
    """Do every task that the folder does not hold yet and put the table together.

    The table does not depend on the engine nor on how often the run was interrupted. Raises
    ExploreError, OSError, and NoMarkersError where force errors are asked for without markers.
    """
    if request.force_error and request.space.spec.design.markers.pattern == "none":
        raise NoMarkersError
    tell = progress or (lambda text, done, total: None)
    with Store.opened(folder) as store:
        run = _Run(store, engine, tell)
        chunks = _design_tasks(request)
        columns = _joined(request, run.results("designs", chunks))
        rows = [k for k, s in enumerate(columns["status"]) if s == "feasible"]
        if request.light:
            columns |= _light(request, columns, rows, run)
        if request.force_error:
            columns |= _force(request, columns, rows, run)
        store.keep_only(run.seen)
        shown = (*(a.path for a in request.space.axes), *VERDICT, *SHOWN, *request.also)
        extra = (LIGHT_COLUMNS if request.light else ()) + (
            FORCE_COLUMNS if request.force_error else ()
        )
        table = {n: columns[n] for n in dict.fromkeys((*shown, *extra))}
        return Exploration(request.space, table, run.done, run.taken_over)


class _Run:
    """Does tasks, counts them, and remembers which belong to this exploration."""

    def __init__(self, store: Store, engine: Engine, tell: Progress) -> None:
        self.store = store
        self.engine = engine
        self.tell = tell
        self.seen: list[Task] = []
        self.done = 0
        self.taken_over = 0

    def results(self, what: str, tasks: Sequence[Task]) -> list[dict[str, Any]]:
        """Results in the order of the tasks, from the store where it has them."""
        self.seen += tasks
        found = {t: r for t in tasks if (r := self.store.read(t)) is not None}
        self.taken_over += len(found)
        todo = [t for t in tasks if t not in found]
        self.tell(what, len(found), len(tasks))
        for task, result in run_tasks(self.engine, todo):
            self.store.write(task, result)
            # As read back, so that a resumed run has the very same values.
            found[task] = json.loads(json.dumps(result))
            self.done += 1
            self.tell(what, len(found), len(tasks))
        return [found[t] for t in tasks]


def _design_tasks(request: Request) -> list[Task]:
    space = request.space
    spec = space.spec.model_dump(mode="json")
    axes = [[a.path, list(a.values)] for a in space.axes]
    return [
        Task.of(
            "designs",
            {
                "spec": spec,
                "axes": axes,
                "rows": [list(r) for r in space.rows(start, stop)],
                "also": list(request.also),
            },
        )
        for start, stop in space.chunks()
    ]


def _joined(request: Request, results: Sequence[dict[str, Any]]) -> dict[str, list[Any]]:
    space = request.space
    columns: dict[str, list[Any]] = {
        axis.path: [row[k] for row in space.rows(0, space.count)]
        for k, axis in enumerate(space.axes)
    }
    for (start, stop), result in zip(space.chunks(), results, strict=True):
        for name, packed in result["columns"].items():
            if name in columns and len(columns[name]) == space.count:
                continue  # an axis
            columns.setdefault(name, []).extend(unpacked(packed, stop - start))
    return columns


def _light(
    request: Request, columns: Mapping[str, list[Any]], rows: Sequence[int], run: _Run
) -> dict[str, list[Any]]:
    keys = {k: tuple(_hashable(columns[n][k]) for n in TRACED) for k in rows}
    distinct = list(dict.fromkeys(keys.values()))
    tasks = [
        Task.of(
            "light",
            {
                "rays": request.rays,
                "scenes": [
                    dict(zip(TRACED, values, strict=True)) for values in distinct[i : i + SCENES]
                ],
            },
        )
        for i in range(0, len(distinct), SCENES)
    ]
    traced = [Traced(**t) for r in run.results("light", tasks) for t in r["traced"]]
    by_key = dict(zip(distinct, traced, strict=True))
    return _spread(
        LIGHT_COLUMNS, columns, {k: light_columns(_Row(columns, k), by_key[keys[k]]) for k in rows}
    )


def _force(
    request: Request, columns: Mapping[str, list[Any]], rows: Sequence[int], run: _Run
) -> dict[str, list[Any]]:
    patches = {k: Patch.of(_Row(columns, k)) for k in rows}
    distinct = list(dict.fromkeys(patches.values()))
    results = run.results("force error", [Task.of("force", asdict(p)) for p in distinct])
    errors = {p: PatchError(**r) for p, r in zip(distinct, results, strict=True)}
    found = {}
    for k in rows:
        error, row = errors[patches[k]], _Row(columns, k)
        values = (
            error.mesh,
            error.noise(row, request.noise_px),
            error.total(row, request.noise_px),
            error.stiffness(row),
        )
        found[k] = dict(zip(FORCE_COLUMNS, values, strict=True))
    return _spread(FORCE_COLUMNS, columns, found)


@dataclass(frozen=True)
class _Row(NamedValues):
    """One design of the table."""

    columns: Mapping[str, list[Any]]
    place: int

    def value(self, name: str) -> Any:
        return self.columns[name][self.place]


def _spread(
    names: Sequence[str], columns: Mapping[str, list[Any]], found: Mapping[int, Mapping[str, float]]
) -> dict[str, list[Any]]:
    count = len(columns["status"])
    return {n: [found[k][n] if k in found else None for k in range(count)] for n in names}


def _hashable(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


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
