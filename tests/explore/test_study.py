"""Explorations: the same table from every engine, after every interruption."""

from __future__ import annotations

import csv
import io
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from explore_samples import MINI20, ROOT, space

from gelslim_cad.explore import space as space_module
from gelslim_cad.explore import study
from gelslim_cad.explore.space import ExploreError
from gelslim_cad.explore.study import Request, explore
from gelslim_cad.explore.table import csv_bytes, parquet_bytes
from gelslim_core.jobs import Engine
from gelslim_core.optional_library import MissingLibraryError

RAYS = 1 << 11


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(space_module, "CHUNK", 4)
    monkeypatch.setattr(study, "SCENES", 2)


def request(**options: object) -> Request:
    return Request(space(), rays=RAYS, **options)  # type: ignore[arg-type]


@pytest.mark.slow
def test_processes_give_the_table_of_one(tmp_path: Path, small_chunks: None) -> None:
    asked = request(light=True)
    alone = explore(asked, tmp_path / "one", Engine(1))
    many = explore(asked, tmp_path / "two", Engine(2))
    assert csv_bytes(alone.columns) == csv_bytes(many.columns)
    assert many.done == alone.done > 3
    lit = [v for v in alone.columns["light.on_coat"] if v is not None]
    assert len(lit) == len(alone.rows_where("feasible")) > 0
    assert all(0.05 < v < 0.5 for v in lit)


@pytest.mark.slow
def test_a_dask_cluster_gives_the_table_of_one(tmp_path: Path, small_chunks: None) -> None:
    distributed = pytest.importorskip(
        "distributed", reason="NOT TESTED: the cluster extra (distributed) is not installed"
    )
    alone = explore(request(), tmp_path / "one", Engine(1))
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        far = explore(request(), tmp_path / "far", Engine(1, cluster.scheduler_address))
    assert csv_bytes(alone.columns) == csv_bytes(far.columns)
    assert far.done == alone.done


def test_a_worker_with_other_code_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr("gelslim_cad.explore.task.signed", lambda task: ("other", {}))
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
        ) as cluster,
        pytest.raises(ExploreError, match="another version"),
    ):
        explore(request(), tmp_path / "far", Engine(1, cluster.scheduler_address))
    assert not list((tmp_path / "far" / "chunks").iterdir())


@pytest.mark.slow
def test_a_killed_worker_is_told_and_the_rest_kept(
    tmp_path: Path, small_chunks: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gelslim_cad.explore.task.signed", _deadly)
    with pytest.raises(ExploreError, match="use fewer jobs"):
        explore(request(), tmp_path / "x", Engine(2))
    monkeypatch.undo()
    monkeypatch.setattr(space_module, "CHUNK", 4)
    assert explore(request(), tmp_path / "x", Engine(1)).done > 0


def _deadly(task: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_no_cluster_is_said_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("gelslim_core.jobs.CONNECT_S", 1)
    with pytest.raises(ExploreError, match="no Dask scheduler answers"):
        explore(request(), tmp_path / "x", Engine(1, "tcp://127.0.0.1:1"))


def test_a_missing_cluster_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingLibraryError) as caught:
        explore(request(), tmp_path / "x", Engine(1, "tcp://127.0.0.1:1"))
    assert (caught.value.name, caught.value.extra) == ("distributed", "cluster")


def test_a_second_run_takes_everything_over(tmp_path: Path, small_chunks: None) -> None:
    first = explore(request(), tmp_path / "x", Engine(1))
    again = explore(request(), tmp_path / "x", Engine(1))
    assert (again.done, again.taken_over) == (0, first.done)
    assert csv_bytes(first.columns) == csv_bytes(again.columns)
    other = explore(Request(space("gel.length_mm=16,18")), tmp_path / "x", Engine(1))
    assert other.taken_over == 0
    assert len(list((tmp_path / "x" / "chunks").iterdir())) == other.done


@pytest.mark.slow
def test_a_damaged_chunk_is_done_again(tmp_path: Path, small_chunks: None) -> None:
    first = explore(request(), tmp_path / "x", Engine(1))
    chunks = sorted((tmp_path / "x" / "chunks").iterdir())
    chunks[0].write_bytes(chunks[0].read_bytes()[:50])
    chunks[1].write_bytes(chunks[2].read_bytes())
    again = explore(request(), tmp_path / "x", Engine(1))
    assert again.done == 2
    assert csv_bytes(first.columns) == csv_bytes(again.columns)


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("x")
    with pytest.raises(ExploreError, match="holds no exploration"):
        explore(request(), tmp_path / "mine", Engine(1))
    assert [p.name for p in (tmp_path / "mine").iterdir()] == ["thesis.txt"]


@pytest.mark.slow
def test_a_killed_run_goes_on(tmp_path: Path) -> None:
    vary = ("--vary", "gel.length_mm=16:24:0.02", "--vary", "camera.f_number=2:5:0.5")
    command = [sys.executable, "-m", "gelslim", "explore", str(MINI20), *vary]
    command += ["-o", str(tmp_path / "x"), "--jobs", "1", "--no-pictures"]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    run = subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.DEVNULL)
    chunks = tmp_path / "x" / "chunks"
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and run.poll() is None:
        if chunks.is_dir() and len(list(chunks.glob("designs-*.json"))) >= 2:
            break
        time.sleep(0.01)
    run.send_signal(signal.SIGKILL)
    run.wait()
    kept = len(list(chunks.glob("designs-*.json")))
    assert kept >= 2
    assert not (tmp_path / "x" / "designs.csv").exists()
    asked = Request(space("gel.length_mm=16:24:0.02", "camera.f_number=2:5:0.5"))
    resumed = explore(asked, tmp_path / "x", Engine(1))
    assert resumed.taken_over == kept
    assert resumed.done + kept == len(list(asked.space.chunks()))


def test_the_tables_read_back(tmp_path: Path) -> None:
    columns = explore(request(also=("led.count",)), tmp_path / "x", Engine(1)).columns
    rows = list(csv.DictReader(io.StringIO(csv_bytes(columns).decode())))
    assert [int(r["design"]) for r in rows] == list(range(len(rows)))
    for name, values in columns.items():
        for row, value in zip(rows, values, strict=True):
            if isinstance(value, float):
                assert float(row[name]) == value
            else:
                assert row[name] == ("" if value is None else str(value))
    parquet = pytest.importorskip("pyarrow.parquet")
    data = parquet_bytes(columns)
    assert data == parquet_bytes(columns)
    table = parquet.read_table(io.BytesIO(data)).to_pydict()
    assert list(table) == ["design", *columns]
    for name, values in columns.items():
        assert table[name] == list(values)


def test_an_unknown_column_is_refused() -> None:
    with pytest.raises(ExploreError, match=r"finger.thicknes"):
        request(also=("finger.thicknes",))
