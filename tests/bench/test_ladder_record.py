"""Ladders of the benches: their fronts, defaults that are beaten, and faults that are refused."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bench.page.accuracy_figure import drawn
from bench.page.accuracy_text import beating, table
from bench.page.ladder_record import LadderRecord, RungRecord


def some_ladder(kind: Any = "ladder", **changes: Any) -> LadderRecord:
    rungs = (
        RungRecord("coarse", 0.4, 1.0, is_paper=True),
        RungRecord("middle", 0.1, 3.0),
        RungRecord("slow", 0.2, 9.0, is_ours=True),
        RungRecord("exact", 0.0, 50.0),
    )
    values: dict[str, Any] = {
        "name": "some", "title": "Some", "question": "?", "paper": "p", "reference": "r",
        "error_label": "e", "error_unit": "relative", "time_label": "t", "time_unit": "ms",
        "source": "s", "rungs": rungs, "kind": kind,
    }  # fmt: skip
    return LadderRecord(**{**values, **changes})


def test_front_against_brute_force() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        rungs = tuple(
            RungRecord(str(k), *map(float, rng.integers(1, 8, 2)), series=str(k % 3))
            for k in range(12)
        )
        (front,) = some_ladder(rungs=rungs).fronts
        for r in rungs:
            beaten = any(
                (o.error < r.error and o.time <= r.time) or (o.error <= r.error and o.time < r.time)
                for o in rungs
            )
            assert (r in front) is not beaten
        assert [r.time for r in front] == sorted(r.time for r in front)
        by_problem = some_ladder("problems", rungs=rungs).fronts
        assert [f[0].series for f in by_problem] == ["0", "1", "2"]


def test_a_default_is_beaten_by_what_is_clearly_better() -> None:
    ladder = some_ladder()
    assert [r.label for r in beating(ladder, ladder.ours[0])] == ["middle"]
    nearly = replace(ladder.ours[0], label="alike", time=8.9)
    same = replace(ladder, rungs=(ladder.rungs[0], ladder.rungs[2], nearly))
    assert beating(same, same.ours[0]) == []


def test_table_marks_ours_papers_and_front() -> None:
    marks = [line.split("|")[-2].strip() for line in table(some_ladder()).splitlines()[2:]]
    assert marks == ["paper, front", "front", "**ours**", "front"]


@pytest.mark.parametrize(
    "rungs",
    [
        (),
        (RungRecord("a", 1.0, 1.0), RungRecord("a", 2.0, 1.0)),
        (RungRecord("a", -1.0, 1.0),),
        (RungRecord("a", math.nan, 1.0),),
    ],
)
def test_bad_ladders_are_refused(rungs: tuple[RungRecord, ...]) -> None:
    with pytest.raises(ValueError, match="some"):
        some_ladder(rungs=rungs)


@pytest.mark.slow
def test_zero_and_single_rungs_are_drawn_and_figures_repeat() -> None:
    assert drawn(some_ladder()) == drawn(some_ladder())
    assert drawn(some_ladder(rungs=(RungRecord("only", 0.0, 0.0, is_ours=True),)))
