"""`gelslim import-sensor`: its files, its refusals, and that nothing of the user is lost."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from gelslim.cli import main
from gelslim_core.yaml.reader import read_model
from gelslim_force.imported.description import SensorDescription
from ifem_export.bundle.files import load_bundle

PITCH_PX, SHAPE = 20, (11, 13)


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    """11 x 13 round dots 20 px apart, seen straight on."""
    y, x = np.mgrid[: PITCH_PX * (SHAPE[0] + 1), : PITCH_PX * (SHAPE[1] + 1)]
    off = np.hypot(*((v + PITCH_PX / 2) % PITCH_PX - PITCH_PX / 2 for v in (x, y)))
    inside = (np.minimum(x, y) > PITCH_PX / 2) & (y < PITCH_PX * (SHAPE[0] + 0.5))
    inside &= x < PITCH_PX * (SHAPE[1] + 0.5)
    dark = np.clip(4.5 - off, 0, 1) * inside
    path = tmp_path / "rest.npy"
    np.save(path, np.rint(180 * (1 - 0.7 * dark)).astype(np.uint8))
    return path


SIZES = ["--length", "14", "--width", "12", "--thickness", "3", "--pitch", "1", "--no-ladder"]


def test_a_picture_and_four_lengths_make_a_sensor(
    picture: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("cv2", reason="draws pictures")
    out = picture.parent / "sensor"
    assert main(["import-sensor", str(picture), *SIZES, "-o", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    there = {p.name for p in out.iterdir() if not p.name.startswith(".")}
    assert there == {"bundle", "calibration.json", "sensor.json", "dots.png"}
    assert told["markers_found"] == SHAPE[0] * SHAPE[1]
    bundle = load_bundle(out / "bundle")
    assert bundle.imported is not None
    assert bundle.imported.sentences() == told["told"]
    assert len(told["told"]["missing"]) >= 3
    assert bundle.tolerances["youngs_modulus_mpa"] > 0.5 * bundle.material.youngs_modulus_mpa
    places = np.asarray(bundle.markers.positions_mm)
    np.testing.assert_allclose(places.min(axis=0), [-6, -5], atol=0.01)
    assert main(["bundle-info", str(out / "bundle")]) == 0
    assert "missing" in capsys.readouterr().out


def test_a_picture_that_is_not_there_is_named_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.yaml"
    assert main(["import-sensor", "--new", str(file)]) == 0
    capsys.readouterr()
    assert main(["import-sensor", str(file)]) == 2
    at = 1 + next(
        k for k, line in enumerate(file.read_text().splitlines()) if "  reference:" in line
    )
    told = capsys.readouterr().err
    assert f"{file}:{at} view.reference" in told
    assert "reference.png" in told


def test_files_of_others_are_kept(picture: Path) -> None:
    out = picture.parent / "mine"
    out.mkdir()
    (out / "sensor.json").write_text("{}")
    assert main(["import-sensor", str(picture), *SIZES, "-o", str(out)]) == 2
    assert (out / "sensor.json").read_text() == "{}"
    assert [p.name for p in out.iterdir()] == ["sensor.json"]


def test_a_description_to_start_from(tmp_path: Path) -> None:
    target = tmp_path / "mine.yaml"
    assert main(["import-sensor", "--new", str(target)]) == 0
    assert read_model(target, SensorDescription).model.name == "mine"
    assert (tmp_path / "gelslim-sensor-1.schema.json").is_file()
    text = target.read_text()
    assert main(["import-sensor", "--new", str(target)]) == 2
    assert target.read_text() == text


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["rest.png"],
        ["rest.png", "--length", "10", "--width", "10", "--thickness", "2"],
        ["rest.png", "--length", "-1", "--width", "10", "--thickness", "2", "--pitch", "1"],
        ["rest.png", *SIZES, "--x-points", "north"],
        ["nowhere.yaml"],
        ["sensor.yaml", "--pitch", "1"],
        ["--new", "a.yaml", "--pitch", "1"],
        ["nowhere.png", *SIZES],
    ],
)
def test_impossible_arguments_are_refused(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["import-sensor", *arguments]) == 2
    assert list(tmp_path.iterdir()) == []


def test_the_schema_is_what_the_repository_holds(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "--sensor"]) == 0
    committed = Path(__file__).parents[2] / "docs" / "gelslim-sensor-1.schema.json"
    assert capsys.readouterr().out == committed.read_text("utf-8")
    assert main(["schema", "--sensor", "--scene"]) == 2
