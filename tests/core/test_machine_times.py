"""This machine's times: where they lie, that damage costs nothing, and that they are whole."""

from __future__ import annotations

import json
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from gelslim_core.budget import machine_times
from gelslim_core.budget.machine_times import (
    cache_folder,
    read_times,
    require_keeping,
    this_machine,
    times_path,
    write_times,
)


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GELSLIM_CACHE_DIR", str(tmp_path / "cache"))


def test_times_come_back() -> None:
    times = {"paper": 0.04, "pcg (rtol 0.01)": 1.5}
    path = write_times("abc", times)
    assert path == times_path("abc")
    assert read_times("abc") == times
    assert read_times("other") == {}
    assert [p.name for p in path.parent.iterdir()] == ["abc.json"]


@pytest.mark.parametrize("text", ["", "{", "[]", '{"times_ms": {"a": 1}}', '{"times_ms": "x"}'])
def test_a_damaged_file_is_as_good_as_none(text: str) -> None:
    write_times("abc", {"a": 1.0}).write_text(text)
    assert read_times("abc") == {}


def test_impossible_times_are_left_out() -> None:
    path = write_times("abc", {"a": 1.0, "b": 2.0})
    record = json.loads(path.read_text())
    record["times_ms"] |= {"b": -1.0, "c": 0.0, "d": float("nan"), "e": float("inf")}
    path.write_text(json.dumps(record))
    assert read_times("abc") == {"a": 1.0}


def test_another_machine_has_times_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    write_times("abc", {"a": 1.0})
    here = this_machine()
    other = machine_times.Machine(here.name, here.processor, here.cores + 2, here.system)
    monkeypatch.setattr(machine_times, "this_machine", lambda: other)
    assert read_times("abc") == {}
    write_times("abc", {"a": 7.0})
    monkeypatch.setattr(machine_times, "this_machine", lambda: here)
    assert read_times("abc") == {"a": 1.0}


def test_a_file_carried_from_elsewhere_is_as_good_as_none() -> None:
    path = write_times("abc", {"a": 1.0})
    for_another = times_path("other")
    for_another.write_bytes(path.read_bytes())
    assert read_times("other") == {}
    record = json.loads(path.read_text())
    for change in ({"format": "gelslim-machine-times/2"}, {"machine": {"name": "elsewhere"}}):
        path.write_text(json.dumps({**record, **change}))
        assert read_times("abc") == {}
    path.write_text(json.dumps(record))
    assert read_times("abc") == {"a": 1.0}


def test_whether_times_can_be_kept_is_known_beforehand(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    require_keeping()
    assert list(times_path("abc").parent.iterdir()) == []
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("GELSLIM_CACHE_DIR", str(tmp_path / "file"))
    with pytest.raises(OSError, match="file"):
        require_keeping()


def test_two_writers_at_once_leave_one_whole_file() -> None:
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda k: write_times("abc", {f"r{i}": k for i in range(300)}), range(1, 65)))
    found = read_times("abc")
    assert len(found) == 300
    assert len(set(found.values())) == 1
    assert [p.name for p in times_path("abc").parent.iterdir()] == ["abc.json"]


def test_a_write_that_fails_leaves_the_old_times(monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_times("abc", {"a": 1.0})

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(machine_times.os, "replace", full)
    with pytest.raises(OSError, match="No space"):
        write_times("abc", {"a": 2.0})
    monkeypatch.undo()
    assert json.loads(path.read_text())["times_ms"] == {"a": 1.0}
    assert [p.name for p in path.parent.iterdir()] == ["abc.json"]


def test_the_folder_follows_the_system(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("GELSLIM_CACHE_DIR")
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache_folder() == tmp_path / "xdg" / "gelslim"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert cache_folder() == tmp_path / ".cache" / "gelslim"
    monkeypatch.setattr(sys, "platform", "darwin")
    assert cache_folder() == tmp_path / "Library" / "Caches" / "gelslim"
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "local"))
    assert cache_folder() == tmp_path / "local" / "gelslim" / "cache"
