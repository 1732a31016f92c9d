"""Stage times over a run against NumPy on all values."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from gelslim_force.forces.stage_clock import TOTAL, FrameClock, StageSummary, StageTimes


def summary(times_ms: np.ndarray, window: int) -> StageSummary:
    """Of frames whose columns are detect and match."""
    made = StageSummary(window)
    for detect, match in times_ms:
        made.add({"detect": detect, "match": match})
    return made


def test_summary_equals_numpy() -> None:
    times = np.random.default_rng(4).gamma(3.0, 0.7, (500, 2))
    stages = summary(times, window=1000).times()
    truth = {"detect": times[:, 0], "match": times[:, 1], TOTAL: times.sum(axis=1)}
    assert [s.stage for s in stages] == list(truth)
    for found, given in zip(stages, truth.values(), strict=True):
        assert found.frames == 500
        np.testing.assert_allclose(
            [found.mean_ms, found.largest_ms, found.median_ms, found.p95_ms, found.p99_ms],
            [given.mean(), given.max(), *np.percentile(given, [50, 95, 99])],
            rtol=1e-9,
        )


def test_percentiles_are_of_the_window_and_extremes_of_the_run() -> None:
    times = np.ones((300, 2))
    times[0] = 50.0
    times[200:, 1] = 2.0
    match = summary(times, window=64).times()[1]
    assert match.median_ms == pytest.approx(2.0)
    assert match.p99_ms == pytest.approx(2.0)
    assert match.largest_ms == pytest.approx(50.0)
    assert match.mean_ms == pytest.approx(times[:, 1].mean())


def test_memory_does_not_grow() -> None:
    made = StageSummary(window=256)
    frame = {"detect": 1.0, "match": 2.0}
    for _ in range(300):
        made.add(frame)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(20_000):
        made.add(frame)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 4096
    assert made.times()[-1].frames == 20_300


def test_times_given_and_a_window_that_is_empty() -> None:
    made = StageSummary()
    made.add({})
    assert made.times() == ()
    made.add({"detect": 1.25, "match": 0.5})
    detect, _, total = made.times()
    assert detect == StageTimes("detect", 1, 1.25, 1.25, 1.25, 1.25, 1.25)
    assert (total.stage, total.median_ms) == (TOTAL, 1.75)
    with pytest.raises(ValueError, match="window = 0"):
        StageSummary(window=0)


def test_stages_of_one_frame_add_up_to_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    now = iter([10.0, 10.002, 10.005, 10.006])
    monkeypatch.setattr("time.perf_counter", lambda: next(now))
    clock = FrameClock()
    for name in ("track", "force", "track"):
        clock.stage(name)
    assert clock.stages == pytest.approx({"track": 3.0, "force": 3.0})
