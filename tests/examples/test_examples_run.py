"""Each example runs as it stands; it asserts its own numbers."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

SLOW = ("frames_to_forces", "data_set", "mujoco_grasp", "train_regressor")
NEEDS = {"mujoco_grasp": "mujoco", "train_regressor": "sklearn"}
"""Modules of extras without which an example is not tested."""
EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))


def test_there_are_examples() -> None:
    assert {p.stem for p in EXAMPLES} >= {"own_finger", *SLOW}


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(p, id=p.stem, marks=pytest.mark.slow if p.stem in SLOW else ())
        for p in EXAMPLES
    ],
)
def test_an_example_runs(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if path.stem in NEEDS:
        module = NEEDS[path.stem]
        pytest.importorskip(module, reason=f"NOT TESTED: the example {path.stem} needs {module}")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tempfile.mkdtemp", lambda: str(tmp_path))
    monkeypatch.setattr("sys.argv", [str(path)])
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out
    assert "assert " in path.read_text(encoding="utf-8")
