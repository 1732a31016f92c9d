"""The best feasible design of a space, refined between the given values, and its active limits."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gelslim_cad.explore.judge import judge
from gelslim_cad.explore.pareto import EXPOSURE, FORCE_ERROR, THICKNESS, Figure
from gelslim_cad.explore.space import Axis, ExploreError, Space, Value
from gelslim_cad.explore.study import Exploration, Progress, Request, explore
from gelslim_cad.spec import Spec
from gelslim_core.jobs import Engine
from gelslim_core.yaml.fields import field_at

Aim = Literal["thin", "bright", "accurate"]
GOALS: dict[Aim, Figure] = {"thin": THICKNESS, "bright": EXPOSURE, "accurate": FORCE_ERROR}
"""What each aim minimises. The brightest design has the shortest exposure time."""
BETWEEN = 2
"""New values between a value and its neighbour in a round of refinement."""
PIECES, ROUNDS = 32, 2
"""The interval is divided into this many pieces, and the piece with the border again."""


@dataclass(frozen=True)
class Neighbour:
    """The optimum with one field a step further: its verdict and its goal.

    Where it is not feasible, `holds_to` is how far the field can go until `stops` ends it: another
    rule perhaps than `binding`, which the neighbour misses most.
    """

    path: str
    value: Value
    status: str
    binding: str
    goal: float | None
    holds_to: float | None = None
    stops: str = ""


@dataclass(frozen=True)
class Optimum:
    """The best design: its row of the table, its values, what a step further along would do."""

    goal: Figure
    values: Mapping[str, Value]
    row: Mapping[str, Any]
    neighbours: tuple[Neighbour, ...]
    at_end: tuple[str, ...]
    """Fields whose best value is an end of what was given: a longer range may hold a better one."""
    designs: int
    feasible: int


def optimise(
    request: Request,
    aim: Aim,
    folder: Path,
    engine: Engine,
    *,
    rounds: int = 3,
    progress: Progress | None = None,
) -> Optimum:
    """Explore the space, then `rounds` times the surroundings of the best design.

    A round puts `BETWEEN` values between the best value and its neighbours, of fields that are
    real numbers; it never leaves the range given. At last the best goes up to the border of what is
    feasible where that is better. The grid finds the basin, so steps should be
    fine enough for the design space's folds. Raises ExploreError where no design is feasible, as
    `explore` does else.
    """
    goal = GOALS[aim]
    asked = replace(request, light=aim == "bright", force_error=aim == "accurate")
    search = _Search(asked, goal, folder, engine)
    designs = feasible = 0
    best: tuple[Value, ...] = ()
    for k in range(rounds + 1):
        found = explore(asked, folder / f"round-{k}", engine, progress)
        designs += found.space.count
        feasible += len(found.rows_where("feasible"))
        best = _best(found, goal)
        finer = _finer(found.space, best)
        if k == rounds or finer == found.space:
            break
        asked = replace(asked, space=finer)
    best, row = search.at_borders(best, _row(found, best))
    given = request.space.axes
    return Optimum(
        goal,
        search.named(best),
        row,
        search.neighbours(best),
        tuple(a.path for a, v in zip(given, best, strict=True) if _ended(a, v)),
        designs,
        feasible,
    )


def _best(found: Exploration, goal: Figure) -> tuple[Value, ...]:
    rows = found.rows_where("feasible")
    if not rows:
        names = [b for b in found.columns["binding"] if b]
        often = max(sorted(set(names)), key=names.count)
        raise ExploreError(
            f"none of the {found.space.count} designs is feasible; most often stopped by {often}. "
            "Vary another field, or further"
        )
    column = found.columns[goal.name]
    return found.space.row(min(rows, key=lambda k: (column[k], k)))


def _row(found: Exploration, design: tuple[Value, ...]) -> dict[str, Any]:
    place = found.space.rows(0, found.space.count).index(design)
    return {n: column[place] for n, column in found.columns.items()}


@dataclass(frozen=True)
class _Search:
    """What to explore around the best design, over the space that was given."""

    request: Request
    goal: Figure
    folder: Path
    engine: Engine

    @property
    def given(self) -> Space:
        return self.request.space

    def named(self, design: Sequence[Value]) -> dict[str, Value]:
        """The values of a design by path."""
        return {a.path: v for a, v in zip(self.given.axes, design, strict=True)}

    def tried(self, name: str, best: Sequence[Value], k: int, values: list[Value]) -> Exploration:
        """The best design with other values of its field number k."""
        axes = tuple(
            Axis(a.path, tuple(values) if j == k else (best[j],))
            for j, a in enumerate(self.given.axes)
        )
        asked = replace(self.request, space=Space(self.given.spec, axes))
        return explore(asked, self.folder / name, self.engine)

    def at_borders(
        self, best: tuple[Value, ...], row: dict[str, Any]
    ) -> tuple[tuple[Value, ...], dict[str, Any]]:
        """The best design moved along each field up to the rule that ends it, if that is better.

        Finer steps only come near a border: the thinnest gel allowed lies between two of them.
        """
        for k, axis in enumerate(self.given.axes):
            if not _real(self.given.spec, axis):
                continue
            for j, beyond in enumerate(_beside(axis, best[k])):
                last = border(self.given.spec, self.named(best), axis.path, beyond)
                if last is None or last.value == best[k]:
                    continue
                tried = self.tried(f"border-{k}-{j}", best, k, [last.value])
                here = tried.columns[self.goal.name][0]
                if tried.rows_where("feasible") and here < row[self.goal.name]:
                    best = (*best[:k], last.value, *best[k + 1 :])
                    row = _row(tried, best)
        return best, row

    def neighbours(self, best: Sequence[Value]) -> tuple[Neighbour, ...]:
        """One step of the given grid to both sides along each field, the others at their best."""
        found = []
        for k, axis in enumerate(self.given.axes):
            others = [v for v in _beside(axis, best[k]) if v != best[k]]
            if not others:
                continue
            tried = self.tried(f"beside-{k}", best, k, others)
            for i, value in enumerate(others):
                cells = (tried.columns[n][i] for n in ("status", "binding", self.goal.name))
                beside = Neighbour(axis.path, value, *cells)
                if _real(self.given.spec, axis):
                    last = border(self.given.spec, self.named(best), axis.path, value)
                    if last is not None:
                        beside = replace(beside, holds_to=last.value, stops=last.stops)
                found.append(beside)
        return tuple(found)


def _real(spec: Spec, axis: Axis) -> bool:
    field = field_at(type(spec), axis.path)
    return axis.numeric and len(axis.values) > 1 and field is not None and float in field.types


def _finer(space: Space, best: Sequence[Value]) -> Space:
    """Values around the best: it, its neighbours, and `BETWEEN` between; other fields fixed."""
    axes = []
    for axis, value in zip(space.axes, best, strict=True):
        if not _real(space.spec, axis):
            axes.append(Axis(axis.path, (value,)))
            continue
        ordered = sorted(float(v) for v in axis.values if v is not None and not isinstance(v, str))
        here = ordered.index(float(value))  # type: ignore[arg-type]
        near = ordered[max(0, here - 1) : here + 2]
        values: list[float] = []
        for low, high in itertools.pairwise(near):
            step = (high - low) / (BETWEEN + 1)
            values += [low, *(float(f"{low + j * step:.10g}") for j in range(1, BETWEEN + 1))]
        axes.append(Axis(axis.path, tuple(dict.fromkeys([*values, near[-1]]))))
    return Space(space.spec, tuple(axes))


def _ended(axis: Axis, value: Value) -> bool:
    if not axis.numeric or len(axis.values) < 2:
        return False
    return value in (min(axis.values), max(axis.values))  # type: ignore[type-var]


def _beside(axis: Axis, value: Value) -> list[Value]:
    if not axis.numeric:
        return list(axis.values)
    ordered: list[Any] = sorted(axis.values)
    below = [v for v in ordered if v < value]
    above = [v for v in ordered if v > value]
    return [*below[-1:], *above[:1]]


@dataclass(frozen=True)
class Border:
    """The last feasible value of a field, and what rules out the next one."""

    value: float
    stops: str


def border(spec: Spec, values: Mapping[str, Value], path: str, beyond: Value) -> Border | None:
    """The border between `values[path]` and `beyond`; None where all values between are feasible.

    All other fields keep their values. The border is rounded towards `values[path]`, to a
    thousandth of the interval or the next greater power of ten.
    """
    axes = [Axis(p, (v,)) for p, v in values.items() if p != path]
    start, end = (float(v) for v in (values[path], beyond))  # type: ignore[arg-type]
    low, high, stops = start, end, ""
    for _ in range(ROUNDS):
        way = [float(f"{v:.10g}") for v in np.linspace(low, high, PIECES + 1)]
        rows = [(*(a.values[0] for a in axes), v) for v in way]
        columns = judge(spec, [*axes, Axis(path, tuple(way))], rows)
        stopped = [k for k, s in enumerate(columns["status"]) if k and s != "feasible"]
        if not stopped:
            break
        first = stopped[0]
        stops = columns["reason"][first] or columns["binding"][first]
        low, high = way[first - 1], way[first]
    return Border(_rounded(low, start, abs(end - start) / PIECES**ROUNDS), stops) if stops else None


def _rounded(value: float, towards: float, step: float) -> float:
    unit = 10.0 ** math.ceil(math.log10(step))
    up = math.ceil(value / unit - 1e-6), math.floor(value / unit + 1e-6)
    near = float(f"{(up[0] if towards > value else up[1]) * unit:.10g}")
    return towards if (near - towards) * (value - towards) <= 0 else near
