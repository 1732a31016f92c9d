"""Tasks come back whole whatever does them, and whatever happens to who does them."""

from __future__ import annotations

import gc
import multiprocessing
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import pool_tasks

from gelslim_core.jobs import Engine, EngineError
from gelslim_core.worker_pool import worker_pool


@pytest.fixture(autouse=True)
def importable_in_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_task_once_whatever_the_jobs(jobs: int) -> None:
    found = dict(Engine(jobs).run(pool_tasks.square, list(range(11))))
    assert found == {k: k * k for k in range(11)}


def test_a_dead_worker_loses_nothing_and_doubles_nothing(tmp_path: Path) -> None:
    tasks = [(str(tmp_path), k) for k in range(9)]
    results = list(Engine(2).run(pool_tasks.dies_once, tasks))
    assert sorted(n for n, _ in results) == list(range(9))
    assert dict(results) == {k: k * k for k in range(9)}
    assert (tmp_path / "died").exists()


def test_a_task_that_kills_its_workers_is_named() -> None:
    with pytest.raises(EngineError, match="task 2 "):
        list(Engine(2).run(pool_tasks.always_dies, list(range(6))))


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_a_task_raises_comes_through(jobs: int) -> None:
    with pytest.raises(ValueError, match="cannot be done"):
        list(Engine(jobs).run(pool_tasks.fails, [4, 5, 6]))


@pytest.mark.slow
def test_a_cluster_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("gelslim_core.jobs.CONNECT_S", 1)
    with pytest.raises(EngineError, match=r"tcp://127\.0\.0\.1:1"):
        list(Engine(scheduler="tcp://127.0.0.1:1").run(pool_tasks.square, [1]))
    with (
        pytest.raises(EngineError, match="no Dask scheduler"),
        Engine(scheduler="tcp://127.0.0.1:1").warmed(pool_tasks.get_ready),
    ):
        pytest.fail("the block must not begin")


def test_a_local_cluster_gives_the_same() -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        found = dict(Engine(scheduler=cluster.scheduler_address).run(pool_tasks.square, [3, 4]))
        assert found == {0: 9, 1: 16}
        # More than are submitted at one time.
        many = dict(Engine(scheduler=cluster.scheduler_address).run(pool_tasks.square, range(23)))
    assert many == {k: k * k for k in range(23)}


def test_every_worker_of_a_cluster_gets_ready_meanwhile() -> None:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None
        ) as cluster,
        Engine(scheduler=cluster.scheduler_address).warmed(pool_tasks.get_ready),
    ):
        assert all(pool_tasks.ready.acquire(timeout=60) for _ in range(2))
    with Engine(2).warmed(pool_tasks.get_ready):
        assert not pool_tasks.ready.acquire(blocking=False)


def test_a_script_that_its_workers_would_run_again_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    Engine(2).require_main()
    monkeypatch.setattr(multiprocessing.current_process(), "_inheriting", True, raising=False)
    Engine(1).require_main()
    with pytest.raises(EngineError, match="__main__"):
        Engine(2).require_main()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="forks")
def test_objects_shared_with_forks_are_left_to_them_by_the_collector() -> None:
    """Frozen objects are not looked through; afterwards all are collected as before."""
    gc.unfreeze()
    try:
        assert gc.get_freeze_count() == 0
        with worker_pool(1, "fork") as pool:
            assert gc.get_freeze_count() > 10_000
            assert pool.submit(gc.get_freeze_count).result() > 10_000
        assert gc.get_freeze_count() == 0
        with worker_pool(1, "spawn"):
            assert gc.get_freeze_count() == 0
    finally:
        gc.freeze()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="forks")
def test_what_a_program_has_frozen_stays_frozen() -> None:
    gc.freeze()
    with worker_pool(1, "fork") as pool:
        assert pool.submit(gc.get_freeze_count).result() > 10_000
    assert gc.get_freeze_count() > 10_000
