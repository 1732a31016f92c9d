"""`gelslim score`: a run against a table of labels."""

import json
from pathlib import Path

import numpy as np
import pytest

from gelslim.cli import main
from gelslim_force.outputs.wrench_csv import AXES, NUMBERS, header


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """Four frames whose normal force is 0, -1, -2, -3 N."""
    rows = np.full((4, len(NUMBERS)), np.nan)
    rows[:, NUMBERS.index("index")] = np.arange(4)
    for axis in AXES:
        rows[:, NUMBERS.index(axis)] = 0.0
        rows[:, NUMBERS.index(f"sigma_{axis}")] = 0.1
    rows[:, NUMBERS.index("fz_n")] = -np.arange(4)
    path = tmp_path / "wrenches.csv"
    text = "".join(",".join(repr(float(v)) for v in row) + ",\n" for row in rows)
    path.write_text(header() + text)
    return path


def test_scores_of_a_sensor_with_other_axes(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    labels = run.with_name("labels.csv")
    labels.write_text("frame,fy_n\n1,1.1\n2,2.1\n3,3.1\n")
    assert main(["score", str(run), str(labels), "--axes", "x,z,-y", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["matched_by"] == "frame"
    (axis,) = found["axes"]
    assert axis["axis"] == "fz_n"
    assert axis["bias"] == pytest.approx(0.1)
    assert axis["z_rms"] == pytest.approx(1.0)
    assert axis["slope"] == pytest.approx(1.0)


@pytest.mark.parametrize(
    "options",
    [["--by", "name"], ["--by", "time_s"], ["--axes", "x,y"], ["--origin-mm", "1,2"]],
)
def test_impossible_options_are_refused(run: Path, options: list[str]) -> None:
    labels = run.with_name("labels.csv")
    labels.write_text("frame,fz_n\n1,-1\n")
    assert main(["score", str(run), str(labels), *options]) == 2


def test_nothing_is_overwritten_that_is_not_a_figure_of_this_program(run: Path) -> None:
    labels = run.with_name("labels.csv")
    labels.write_text("frame,fz_n\n1,-1\n")
    assert main(["score", str(run), str(labels), "--figure", str(labels)]) == 2
    assert labels.read_text() == "frame,fz_n\n1,-1\n"
