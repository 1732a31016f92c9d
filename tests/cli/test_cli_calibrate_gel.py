"""`gelslim calibrate-gel` and `gelslim force --gel-calibration` as a user runs them."""

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

BUILT = Built(young=0.8, thickness=1.05)
LOADS_G = (8, 15, 28, 45)


@pytest.fixture(scope="module")
def sensor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bundle, a folder with a picture at rest, and a table of loads."""
    place = tmp_path_factory.mktemp("built sensor é")
    write_bundle(place / "bundle", ball_bundle())
    (place / "presses").mkdir()
    (place / "presses" / "a_rest.png").write_bytes(encoded(rest_picture(), ".png"))
    lines = [f"p{number}.png,{load}" for number, load in enumerate(LOADS_G)]
    (place / "LOADS.csv").write_text("picture,load_g\n" + "\n".join(lines), encoding="utf-8")
    return place


def run(sensor: Path, *more: str, loads: str = "LOADS.csv", ball: str = "12") -> int:
    given = (str(sensor / "bundle"), str(sensor / "presses"), str(sensor / loads))
    return main(["calibrate-gel", *given, "--ball-mm", ball, *more])


def test_bad_input_is_refused_in_words(sensor: Path, tmp_path: Path, capsys) -> None:
    out = str(tmp_path / "gel.json")
    tables = {
        "nameless.csv": ("picture,load_g\n,8\n", "line 2"),
        "negative.csv": ("picture,load_g\na_rest.png,-8\n", "load_g = -8"),
        "absent.csv": ("picture,load_g\nq.png,8\n", "q.png"),
        "one.csv": ("picture,load_g\na_rest.png,8\n", "without contact"),
    }
    for name, (text, words) in tables.items():
        (sensor / name).write_text(text, encoding="utf-8")
        assert run(sensor, "-o", out, loads=name) == 2, name
        said = capsys.readouterr()
        assert words in said.err, name
        assert "Traceback" not in said.err
    assert run(sensor, "-o", out, loads="none.csv") == 2
    assert "no such file" in capsys.readouterr().err
    (tmp_path / "mine.json").write_text("{}", encoding="utf-8")
    assert run(sensor, "-o", str(tmp_path / "mine.json")) == 2
    assert "mine.json" in capsys.readouterr().err
    assert not Path(out).exists()


def test_force_refuses_a_file_that_is_no_gel_calibration(sensor: Path, tmp_path, capsys) -> None:
    rest = str(sensor / "presses" / "a_rest.png")
    given = ["force", str(sensor / "bundle"), rest, "-r", rest, "-o", str(tmp_path / "run")]
    assert main([*given, "--gel-calibration", str(tmp_path / "none.json")]) == 2
    assert "calibrate-gel" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_a_built_gel_is_found_and_used(sensor: Path, tmp_path: Path, capsys) -> None:
    rng = np.random.default_rng(4)
    for number, load in enumerate(LOADS_G):
        place = rng.uniform(-3, 3, 2)
        picture = ball_picture(BUILT, load * 9.80665e-3, place, 700 + number)
        (sensor / "presses" / f"p{number}.png").write_bytes(encoded(picture, ".png"))
    out, page = tmp_path / "made" / "gel.json", tmp_path / "gel.html"
    assert run(sensor, "-o", str(out), "--report", str(page)) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Young's modulus" in said
    assert "p3.png" in said
    assert "Law of the gel: linear in 4 presses." in said
    assert "<svg" in page.read_text(encoding="utf-8")
    record = json.loads(out.read_text(encoding="utf-8"))
    assert record["youngs_modulus_mpa"] == pytest.approx(0.8 * YOUNG_MPA, rel=0.05)
    assert record["thickness_mm"] == pytest.approx(2.1, rel=0.03)
    assert run(sensor, "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["reference"] == "a_rest.png"
    deep = sum(p["depth_mm"] >= 0.1 * answer["thickness_mm"] for p in answer["presses"])
    assert answer["gel"] == record["gel"]
    assert answer["gel"]["law"] == "linear"
    assert answer["gel"]["presses"] == {"linear": 4, "neo_hookean": 0, "deep_linear": deep}
    assert run(sensor, "--fit-skin", "--json") == 0
    worn = json.loads(capsys.readouterr().out)
    assert worn["skin_n_per_mm"] < 0.01
    assert worn["parameters"][-1] == "skin_n_per_mm"
    assert len(worn["covariance"]) == 4
    assert run(sensor, ball="20") == 2
    assert "fit a ball of 1" in capsys.readouterr().err

    frames = str(sensor / "presses" / "p3.png")
    rest = str(sensor / "presses" / "a_rest.png")
    given = ["force", str(sensor / "bundle"), frames, "-r", rest, "--pictures", "0", "--json"]
    found = {}
    for name, more in (("designed", []), ("built", ["--gel-calibration", str(out)])):
        folder = ["-o", str(tmp_path / name), "--indenter", "unknown"]
        assert main([*given, *folder, *more]) == 0
        answer = json.loads(capsys.readouterr().out)
        found[name] = answer["last_wrench"][2], answer["last_sigma"][2]
    truth = -LOADS_G[3] * 9.80665e-3
    assert abs(found["designed"][0] - truth) > 0.1 * abs(truth)
    assert abs(found["built"][0] - truth) < 2 * found["built"][1]
    assert abs(found["built"][0] - truth) < 0.07 * abs(truth)
    manifest = json.loads((tmp_path / "built" / "run.json").read_text(encoding="utf-8"))
    assert str(out) in json.dumps(manifest)
