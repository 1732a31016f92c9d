"""`gelslim cameras`, and specs that `gelslim new --camera` writes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gelslim.cli import main
from gelslim_cad.spec.camera import camera_names
from gelslim_cad.spec.camera_library import library_camera
from gelslim_cad.spec.reader import read_spec

Capture = pytest.CaptureFixture[str]


def test_the_list_has_a_row_for_each_camera_that_fits_a_narrow_terminal(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["cameras"]) == 0
    lines = capsys.readouterr().out.splitlines()
    for name in camera_names():
        row = next(line for line in lines if line.startswith(name))
        assert row.split()[-1] == f"{library_camera(name).modes[0].frame_rate_hz:.0f}"
    assert main(["cameras", "--json"]) == 0
    rows = {row["name"]: row for row in json.loads(capsys.readouterr().out)}
    assert set(rows) == set(camera_names())
    # 3280 x 2464 pixels of 1.12 um behind 3.04 mm: the sheet says 62.2 and 48.8 degrees.
    assert rows["imx219_v2"]["field_of_view_deg"] == pytest.approx([62.2, 48.8], abs=0.1)
    assert (rows["ov9281"]["picture"], rows["ov9281"]["shutter"]) == ("mono", "global")


@pytest.mark.parametrize("name", camera_names())
def test_one_camera_is_shown_with_every_figure_source_and_mode(
    name: str, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "110")
    assert main(["cameras", name]) == 0
    shown, entry = capsys.readouterr().out, library_camera(name)
    assert all(figure in shown for figure in entry.figures)
    assert all(mode.name in shown for mode in entry.modes)
    assert all(source.text.split()[0] in shown for source in entry.sources)
    assert shown.count("] assumed") == sum(
        len([f for f in s.gives if f != "modes"]) for s in entry.sources if s.assumed
    ) + sum(s.assumed for s in entry.sources)
    assert main(["cameras", name, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [s["text"] for s in told["sources"]] == [s.text for s in entry.sources]
    assert told["camera"] == entry.camera


def test_an_unknown_camera_is_bad_input_and_nothing_is_written(
    tmp_path: Path, capsys: Capture
) -> None:
    assert main(["cameras", "ov9821"]) == 2
    assert "ov9281" in capsys.readouterr().err
    target = tmp_path / "mine.yaml"
    assert main(["new", "mine", "--camera", "ov9821", "-o", str(target)]) == 2
    assert main(["new", "mine", "--camera", "ov9281", "--from", "thin", "-o", str(target)]) == 2
    assert not target.exists()


QUICK = ("ov9281", "ov5647_spy", "ovm6946")


@pytest.mark.parametrize(
    "name",
    [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in camera_names()],
)
def test_a_new_spec_takes_the_camera_and_check_judges_it(
    name: str, tmp_path: Path, capsys: Capture
) -> None:
    target = tmp_path / "mine.yaml"
    assert main(["new", "mine", "--camera", name, "-o", str(target)]) == 0
    loaded = read_spec(target)
    assert loaded.spec.camera.model == name
    assert loaded.lent["camera.focal_length_mm"]
    capsys.readouterr()
    assert main(["check", str(target), "--json"]) in (0, 1)
    told = {c["id"]: c["status"] for c in json.loads(capsys.readouterr().out)["checks"]}
    assert told["led.colours_nm"] == "pass"
