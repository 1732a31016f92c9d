"""Stage times of a frame, and their medians over a run against NumPy on all values."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.pipeline import FrameClock
from gelslim_force.run import TOTAL, RunSummary


def summary(times_ms: np.ndarray) -> RunSummary:
    """Of frames whose columns are detect and match."""
    made = RunSummary()
    for k, (detect, match) in enumerate(times_ms):
        made.add(FrameResult(k, float(k), stage_ms={"detect": detect, "match": match}))
    return made


def test_medians_equal_numpy() -> None:
    times = np.random.default_rng(4).gamma(3.0, 0.7, (500, 2))
    found = summary(times).median_ms()
    truth = {"detect": times[:, 0], "match": times[:, 1], TOTAL: times.sum(axis=1)}
    assert list(found) == list(truth)
    for name, given in truth.items():
        assert found[name] == pytest.approx(np.median(given), rel=1e-12)


def test_medians_are_of_the_last_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gelslim_force.run._TIMED_FRAMES", 64)
    times = np.ones((300, 2))
    times[200:, 1] = 2.0
    assert summary(times).median_ms() == {"detect": 1.0, "match": 2.0, TOTAL: 3.0}


def test_memory_does_not_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gelslim_force.run._TIMED_FRAMES", 256)
    frame = FrameResult(0, 0.0, stage_ms={"detect": 1.0, "match": 2.0})
    made = RunSummary()
    for _ in range(300):
        made.add(frame)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(20_000):
        made.add(frame)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 8192
    assert made.frames == 20_300


def test_a_run_without_times_has_no_medians() -> None:
    made = RunSummary()
    made.add(FrameResult(0, 0.0))
    assert made.median_ms() == {}
    made.add(FrameResult(1, 1.0, stage_ms={"detect": 1.25, "match": 0.5}))
    assert made.median_ms() == {"detect": 1.25, "match": 0.5, TOTAL: 1.75}


def test_stages_of_one_frame_add_up_to_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    now = iter([10.0, 10.002, 10.005, 10.006])
    monkeypatch.setattr("time.perf_counter", lambda: next(now))
    clock = FrameClock()
    for name in ("track", "force", "track"):
        clock.stage(name)
    assert clock.stages == pytest.approx({"track": 3.0, "force": 3.0})


def test_problems_that_differ_in_numbers_count_with_the_first() -> None:
    made = RunSummary()
    for force in (0.25, 13.5, 7):
        made.add(FrameResult(0, 0.0, problems=(f"a force of {force} N is too large",)))
    made.add(FrameResult(0, 0.0, problems=("nothing is seen",)))
    assert made.problems == {"a force of 0.25 N is too large": 3, "nothing is seen": 1}
