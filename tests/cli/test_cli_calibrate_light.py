"""`gelslim calibrate-light` and `gelslim force --light-calibration` as a user runs them."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "force"))
from ball_presses import YOUNG_MPA, Built, ball_bundle, ball_picture, rest_picture

from gelslim.cli.main import main
from gelslim_force.outputs.canvas import encoded
from ifem_export.bundle.files import write_bundle

HIDDEN = Built(poissons_ratio=0.3223, light=(1.15, 0.85, 1.0), ball_mm=3.0)


@pytest.fixture(scope="module")
def sensor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bundle with light, and a picture at rest in the folder of the presses."""
    place = tmp_path_factory.mktemp("lit sensor")
    write_bundle(place / "bundle", ball_bundle(0.3223))
    (place / "presses").mkdir()
    (place / "presses" / "rest.png").write_bytes(encoded(rest_picture(), ".png"))
    return place


def run(sensor: Path, *more: str, ball: str = "6") -> int:
    rest = str(sensor / "presses" / "rest.png")
    given = (str(sensor / "bundle"), rest, str(sensor / "presses"))
    return main(["calibrate-light", *given, "--ball-mm", ball, *more])


def test_bad_input_is_refused_in_words(sensor: Path, tmp_path: Path, capsys) -> None:
    (tmp_path / "mine.json").write_text("{}", encoding="utf-8")
    assert run(sensor, "-o", str(tmp_path / "mine.json")) == 2
    assert "mine.json" in capsys.readouterr().err
    rest = str(sensor / "presses" / "rest.png")
    force = ["force", str(sensor / "bundle"), rest, "-r", rest, "-o", str(tmp_path / "run")]
    assert main([*force, "--indenter", "sphere:6", "--light-calibration", "x.json"]) == 2
    assert "unknown shape" in capsys.readouterr().err
    assert main([*force, "--indenter", "unknown", "--light-calibration", "x.json"]) == 2
    assert "calibrate-light" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_a_built_light_is_found_and_used(sensor: Path, tmp_path: Path, capsys) -> None:
    assert run(sensor) == 2
    assert "0 presses" in capsys.readouterr().err
    rng = np.random.default_rng(4)
    for number in range(6):
        place = rng.uniform(-6, 6, 2)
        picture = ball_picture(HIDDEN, YOUNG_MPA * rng.uniform(0.6, 2.0), place, 800 + number)
        (sensor / "presses" / f"p{number}.png").write_bytes(encoded(picture, ".png"))
    out, page = tmp_path / "made" / "light.json", tmp_path / "light.html"
    assert run(sensor, "-o", str(out), "--report", str(page)) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Light in red" in said
    assert "p5.png" in said
    assert "Law of the gel: linear in 6 presses." in said
    assert "<svg" in page.read_text(encoding="utf-8")
    record = json.loads(out.read_text(encoding="utf-8"))
    assert record["gel"]["law"] == "linear"
    assert record["gel"]["presses"]["linear"] == len(record["presses"]) == 6
    gains = np.array(record["gain"])[:, 0] / record["gamma"]
    assert gains == pytest.approx([1.15, 0.85], rel=0.05)
    assert run(sensor, ball="12") == 2
    assert "fit a ball of" in capsys.readouterr().err
    rest = str(sensor / "presses" / "rest.png")
    frame = str(sensor / "presses" / "p2.png")
    force = ["force", str(sensor / "bundle"), frame, "-r", rest, "--indenter", "unknown"]
    more = ["--light-calibration", str(out), "--pictures", "0", "-o", str(tmp_path / "run")]
    assert main([*force, *more, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["last_wrench"][2] < 0
    manifest = (tmp_path / "run" / "run.json").read_text(encoding="utf-8")
    assert str(out) in manifest
