"""`gelslim bench`: times of this machine, kept beside; what they may change and what never."""

from __future__ import annotations

import hashlib
import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "force"))
from sensor_samples import frame, sensor_bundle, stream

from gelslim.cli.main import main
from gelslim_core.budget.budget import Budget
from gelslim_core.budget.machine_times import read_times, times_path, write_times
from gelslim_force.outputs.canvas import encoded
from ifem_export.bundle.bundle import Bundle
from ifem_export.bundle.files import load_bundle, write_bundle
from ifem_export.operators.ladder import operator_choices
from ifem_export.operators.operator_ladder import MeasuredRung, OperatorLadder
from ifem_export.operators.surface_operator import surface_operator


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GELSLIM_CACHE_DIR", str(tmp_path / "cache"))


@pytest.fixture(scope="module")
def laddered() -> Bundle:
    """The small sensor with a ladder whose errors and times are made up; bytes are its own."""
    bare = sensor_bundle()
    rungs = []
    for k, (rung, parameters) in enumerate(operator_choices(bare.mesh)):
        made = surface_operator(bare.mesh, bare.material, bare.formulation, rung, **parameters)
        error = 0.4 / 1.7**k
        rungs.append(
            MeasuredRung(rung, parameters, error, error, error, 1.0, 1.0, 1.0 + k, made.n_bytes)
        )
    return with_ladder(bare, OperatorLadder(tuple(rungs), "made up", 4, "bbar", 0.3223))


def with_ladder(bundle: Bundle, ladder: OperatorLadder) -> Bundle:
    from dataclasses import replace

    return replace(bundle, ladder=ladder, operator=ladder.balanced().label)


@pytest.fixture
def sensor(laddered: Bundle, tmp_path: Path) -> Path:
    place = tmp_path / "sensor é"
    write_bundle(place / "bundle", laddered)
    (place / "reference.png").write_bytes(encoded(frame(0.0).image, ".png"))
    (place / "frames").mkdir()
    for k, seen in enumerate(stream(2)):
        (place / "frames" / f"f{k}.png").write_bytes(encoded(seen.image, ".png"))
    return place


def digests(folder: Path) -> dict[str, str]:
    return {
        str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in sorted(folder.rglob("*"))
        if p.is_file()
    }


def forces(sensor: Path, out: Path, *more: str) -> int:
    given = [str(sensor / "bundle"), str(sensor / "frames"), "-r", str(sensor / "reference.png")]
    return main(["force", *given, "-o", str(out), "--pictures", "0", "--json", *more])


@pytest.mark.slow
def test_times_are_kept_beside_and_the_bundle_is_untouched(
    sensor: Path, laddered: Bundle, capsys: pytest.CaptureFixture[str]
) -> None:
    before = digests(sensor)
    assert main(["bench", str(sensor / "bundle"), "--no-simulation", "--json"]) == 0
    (part,) = json.loads(capsys.readouterr().out)["parts"]
    assert part["before_from"] == "bundle"
    assert laddered.ladder is not None
    assert [r["rung"] for r in part["rungs"]] == [r.label for r in laddered.ladder.rungs]
    assert [r["before"] for r in part["rungs"]] == [r.milliseconds for r in laddered.ladder.rungs]
    assert digests(sensor) == before
    assert read_times(laddered.times_key) == {r["rung"]: r["now"] for r in part["rungs"]}
    assert main(["bench", str(sensor / "bundle"), "--no-simulation"]) == 0
    said = capsys.readouterr().out
    assert "before" in said
    assert "factor" in said
    assert str(times_path(laddered.times_key).parents[2]) in said.replace("\n", "")


@pytest.mark.slow
def test_a_time_budget_uses_this_machines_times(
    sensor: Path, laddered: Bundle, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert laddered.ladder is not None
    # In the bundle only `paper` takes 1 ms; on this machine everything but `paper` is quick.
    assert forces(sensor, tmp_path / "a", "--time", "1.5ms") == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["operator"] == "paper"
    assert "`gelslim bench " in said.err
    times = {r.label: 0.5 for r in laddered.ladder.rungs} | {"paper": 9.0}
    write_times(laddered.times_key, times)
    assert forces(sensor, tmp_path / "b", "--time", "1.5ms") == 0
    said = capsys.readouterr()
    best = min(laddered.ladder.rungs, key=lambda r: r.error_field)
    assert json.loads(said.out)["operator"] == best.rung
    assert "bench" not in said.err


@pytest.mark.slow
def test_times_never_change_the_forces_of_an_error_budget(
    sensor: Path, laddered: Bundle, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(11)
    assert laddered.ladder is not None
    runs, told = [], set()
    for name in ("before", "after"):
        assert forces(sensor, tmp_path / name, "--error", "5%") == 0
        told.add(capsys.readouterr().err)
        files = digests(tmp_path / name)
        runs.append({k: v for k, v in files.items() if not k.endswith("run.json")})
        write_times(
            laddered.times_key,
            {r.label: float(10 ** rng.uniform(-4, 4)) for r in laddered.ladder.rungs},
        )
    fields = [k for k in runs[0] if k.endswith(".npz")]
    assert fields
    assert all(runs[0][k] == runs[1][k] for k in fields)
    # The table of wrenches tells how long each frame took: all but that must be the same.
    assert untimed(tmp_path / "before") == untimed(tmp_path / "after")
    assert len(told) == 1


def untimed(run: Path) -> list[list[str]]:
    header, *rows = [
        line.split(",")
        for line in (run / "wrenches.csv").read_text().splitlines()
        if not line.startswith("#")
    ]
    kept = [i for i, name in enumerate(header) if not name.strip().endswith("_ms")]
    return [[row[i] for i in kept] for row in (header, *rows)]


def test_an_unmeetable_budget_names_both_sides(
    sensor: Path, laddered: Bundle, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert forces(sensor, tmp_path / "no", "--error", "5%", "--time", "0.001ms") == 2
    message = json.loads(capsys.readouterr().out)["message"]
    assert "5 %" in message
    assert "0.001 ms" in message
    assert laddered.ladder is not None
    quick, good = laddered.ladder.choices.nearest(Budget(0.05, 0.001))
    assert message.index(str(quick)) < message.index(str(good))
    assert not (tmp_path / "no").exists()


def test_what_is_outside_the_calibration_is_said(
    sensor: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert forces(sensor, tmp_path / "loose", "--error", "900%") == 0
    assert "900 %" in capsys.readouterr().err
    assert forces(sensor, tmp_path / "deep", "--error", "5%", "--gel", "neo_hookean") == 0
    assert "linear gel" in capsys.readouterr().err


@pytest.mark.slow
def test_a_full_disk_and_a_damaged_bundle_are_told(
    sensor: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from gelslim_core.budget import machine_times

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device", "times.json")

    with monkeypatch.context() as patch:
        patch.setattr(machine_times.os, "replace", full)
        assert main(["bench", str(sensor / "bundle"), "--no-simulation"]) == 2
    said = capsys.readouterr()
    assert "operators-" in said.err
    assert "Traceback" not in said.err
    path = sensor / "bundle" / "ladder.json"
    path.write_text(path.read_text().replace("paper", "papet"))
    assert main(["bench", str(sensor / "bundle"), "--no-simulation"]) == 2
    assert "ladder.json" in capsys.readouterr().err
    assert main(["bench", str(sensor / "gone.yaml")]) == 2


def test_a_place_that_keeps_nothing_is_told_before_measuring(
    sensor: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    from ifem_export.operators import ladder

    def measured(*_: object) -> None:
        raise AssertionError("measured in vain")

    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("GELSLIM_CACHE_DIR", str(tmp_path / "file"))
    monkeypatch.setattr(ladder, "time_operators", measured)
    assert main(["bench", str(sensor / "bundle"), "--no-simulation"]) == 2
    said = capsys.readouterr().err
    assert str(tmp_path / "file") in said


def test_times_of_other_rungs_do_not_calibrate_the_one_chosen(
    sensor: Path, laddered: Bundle, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_times(laddered.times_key, {"factor": 900.0})
    assert forces(sensor, tmp_path / "a", "--time", "1.5ms") == 0
    assert "gelslim bench" in capsys.readouterr().err


def test_the_label_of_an_error_is_the_same_in_every_bundle_made(laddered: Bundle) -> None:
    """Two builds on machines of other speed give bundles with the same operator."""
    rng = np.random.default_rng(13)
    assert laddered.ladder is not None
    labels = set()
    for _ in range(20):
        timed = laddered.ladder.timed(
            {r.label: float(10 ** rng.uniform(-4, 4)) for r in laddered.ladder.rungs}
        )
        labels.add((timed.balanced().label, timed.choose(Budget(0.1)).rung.name))
    assert len(labels) == 1


def test_the_bundle_alone_is_loaded_as_it_was_written(sensor: Path, laddered: Bundle) -> None:
    write_times(laddered.times_key, {"paper": 77.0})
    loaded = load_bundle(sensor / "bundle")
    assert loaded.ladder == laddered.ladder
    assert loaded.times_key == laddered.times_key


@pytest.mark.slow
def test_the_time_of_a_pose_is_measured_against_what_is_declared(tmp_path: Path) -> None:
    from gelslim.contacts import machine_paces, twin_key
    from gelslim_twin.planning.sensor_figures import bundle_figures
    from gelslim_twin.planning.tolerance_ladder import GEL, LARGE_STRAIN, PICTURE

    sys.path.insert(0, str(Path(__file__).parents[1] / "twin"))
    from sim_rig import small_sensor

    place = small_sensor(tmp_path)
    assert main(["bench", str(place)]) == 0
    figures = bundle_figures(place)
    paces = machine_paces(figures)
    assert paces == read_times(twin_key(figures))
    assert {GEL, PICTURE} <= set(paces) <= {GEL, LARGE_STRAIN, PICTURE}
    assert all(1e-3 < pace < 1e4 for pace in paces.values())
