"""Stage times against NumPy on all values, with a clock that the test winds."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from gelslim_force.forces.stage_clock import TOTAL, StageClock, StageTimes


class HandClock:
    """Returns the time it was set to."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def run(durations_ms: np.ndarray, **settings: int) -> StageClock:
    """A clock that saw the frames: columns are detect, match and detect again."""
    hand = HandClock()
    clock = StageClock(now_s=hand, **settings)
    for first, second, third in durations_ms / 1e3:
        for name, length in (("detect", first), ("match", second), ("detect", third)):
            with clock.stage(name):
                hand.now += length
        clock.frame_done()
    return clock


def test_summary_equals_numpy() -> None:
    times = np.random.default_rng(4).gamma(3.0, 0.7, (500, 3))
    detect, match, total = run(times, window=1000).summary()
    truth = {"detect": times[:, 0] + times[:, 2], "match": times[:, 1], TOTAL: times.sum(axis=1)}
    assert [detect.stage, match.stage, total.stage] == list(truth)
    for found, given in zip((detect, match, total), truth.values(), strict=True):
        assert found.frames == 500
        np.testing.assert_allclose(
            [found.mean_ms, found.largest_ms, found.median_ms, found.p95_ms, found.p99_ms],
            [given.mean(), given.max(), *np.percentile(given, [50, 95, 99])],
            rtol=1e-9,
        )


def test_percentiles_forget_and_extremes_do_not() -> None:
    times = np.ones((300, 3))
    times[0] = 50.0
    times[200:, 1] = 2.0
    match = run(times, window=64).summary()[1]
    assert match.median_ms == pytest.approx(2.0)
    assert match.p99_ms == pytest.approx(2.0)
    assert match.largest_ms == pytest.approx(50.0)
    assert match.mean_ms == pytest.approx(times[:, 1].mean())


def test_warm_up_is_left_out() -> None:
    times = np.ones((30, 3))
    times[:5] = 900.0
    match = run(times, warm_up=5).summary()[1]
    assert (match.frames, match.largest_ms) == (25, pytest.approx(1.0))


def test_a_stage_that_fails_is_timed() -> None:
    hand = HandClock()
    clock = StageClock(now_s=hand)

    def fail() -> None:
        with clock.stage("detect"):
            hand.now += 0.004
            raise RuntimeError("no dots")

    with pytest.raises(RuntimeError, match="no dots"):
        fail()
    assert clock.frame_done() == pytest.approx({"detect": 4.0})


def test_memory_does_not_grow() -> None:
    clock = StageClock(window=256)
    frame = {"detect": 1.0, "match": 2.0}
    for _ in range(300):
        clock.add(frame)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(20_000):
        clock.add(frame)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 4096
    assert clock.summary()[-1].frames == 20_300


def test_times_given_and_refusals() -> None:
    clock = StageClock()
    assert clock.summary() == ()
    clock.add({})
    assert clock.summary() == ()
    clock.add({"detect": 1.25, "match": 0.5})
    detect, _, total = clock.summary()
    assert detect == StageTimes("detect", 1, 1.25, 1.25, 1.25, 1.25, 1.25)
    assert (total.stage, total.median_ms) == (TOTAL, 1.75)
    with pytest.raises(ValueError, match="window = 0"):
        StageClock(window=0)

    def total() -> None:
        with clock.stage(TOTAL):
            pass

    with pytest.raises(ValueError, match="sum of all stages"):
        total()
