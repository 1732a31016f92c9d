"""`gelslim doctor` tells the truth about this installation and about poorer ones."""

from __future__ import annotations

import json
import tomllib
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
from cli_samples import ROOT, fresh

from gelslim import doctor
from gelslim.cli import main
from gelslim.doctor import RealTime, Timed
from gelslim_core import optional_library
from gelslim_core.optional_library import EXTRAS, extra_of, install_command, installed


def answered(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    assert main(["doctor", *arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_versions_are_those_installed(capsys: pytest.CaptureFixture[str]) -> None:
    answer = answered(capsys, "--quick")
    found = {lib["module"]: lib["version"] for lib in answer["required"]}
    assert found["numpy"] == metadata.version("numpy")
    assert all(found.values())
    assert answer["threads"]["usable"] >= 1
    assert answer["real_time"] is None


def test_the_extras_are_those_of_the_package() -> None:
    with open(ROOT / "pyproject.toml", "rb") as stream:
        listed = tomllib.load(stream)["project"]["optional-dependencies"]
    for extra in EXTRAS:
        wanted = {line.partition(">")[0] for line in listed[extra.name]}
        named = {doctor.DISTRIBUTIONS.get(m, m) for m in extra.modules}
        assert named == wanted, extra.name
    assert {e.name for e in EXTRAS} == set(listed) - {
        "dev",
        "docs",
        "mutants",
        "peers",
        "mitsuba",
        "all",
    }


def test_a_missing_extra_is_named_with_its_command(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    lacking = {"cadquery", "distributed"}

    def without(module: str) -> bool:
        return module not in lacking and installed(module)

    monkeypatch.setattr(optional_library, "installed", without)
    monkeypatch.setattr(doctor, "installed", without)
    states = {e["name"]: e for e in answered(capsys, "--quick")["extras"]}
    assert states["cad"]["ready"] is False
    assert states["cluster"]["ready"] is False
    assert main(["doctor", "--quick"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    for extra in ("cad", "cluster"):
        assert install_command(extra) in shown


def test_a_library_that_does_not_load_or_ends_its_process_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "broken_one.py").write_text("raise ImportError('libGL.so.1: no such file')")
    (tmp_path / "deadly_one.py").write_text("import os; os._exit(7)")
    (tmp_path / "sound_one.py").write_text("")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    found = doctor.loading(["broken_one", "deadly_one", "sound_one"])
    assert "libGL.so.1" in found["broken_one"]
    assert "7" in found["deadly_one"]
    assert found["sound_one"] == ""


def test_modules_lead_to_their_extra() -> None:
    assert extra_of("OCP") == extra_of("cadquery") == "cad"
    assert extra_of("matplotlib") == "plot"
    assert extra_of("vtkmodules") == "view"
    assert extra_of("pyarrow") == "record"
    assert extra_of("json") == ""


def test_real_time_is_judged_by_the_quickest_operator() -> None:
    quick, slow = Timed("fft", 0.1, 0.4), Timed("factor", 4.0, 4.1)
    found = RealTime((slow, quick))
    assert found.quickest is quick
    assert found.ready
    assert "fft" in found.advice
    assert "factor" not in found.advice
    assert not RealTime((slow,)).ready
    assert RealTime((slow,)).advice == ""


@pytest.mark.slow
def test_the_whole_examination_in_a_fresh_process() -> None:
    done = fresh("doctor", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    answer = json.loads(done.stdout)
    times = [t["one_thread_ms"] for t in answer["real_time"]["operators"]]
    assert len(times) == 3
    assert all(t > 0 for t in times)
    for extra in answer["extras"]:
        whole = all(lib["version"] and not lib["problem"] for lib in extra["libraries"])
        assert extra["ready"] == whole
