"""`gelslim plan` and the schema of scenes on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_samples import ROOT

from gelslim.cli import main
from gelslim_twin.effects.registry import EFFECTS

SCENES = ROOT / "designs" / "scenes"


@pytest.mark.slow
def test_the_table_names_every_effect_and_the_time(capsys):
    assert main(["plan", str(SCENES / "press_sphere.yaml")]) == 0
    shown = capsys.readouterr().out
    for effect in EFFECTS:
        assert effect.name in shown
    assert "17 poses" in shown
    assert main(["plan", str(SCENES / "press_sphere.yaml"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["over_tolerance"] == []


def test_a_switched_off_effect_that_matters_is_told(capsys):
    assert main(["plan", str(SCENES / "shear_sphere.yaml"), "--json"]) == 0
    over = json.loads(capsys.readouterr().out)["over_tolerance"]
    assert "force" in over
    assert main(["plan", str(SCENES / "shear_sphere.yaml")]) == 0
    assert "nonlinearity" in capsys.readouterr().out.partition(" poses: ")[2]


@pytest.mark.slow
def test_json_from_a_bundle_is_that_from_its_spec(tmp_path, capsys):
    bundle = tmp_path / "sensor"
    spec = ROOT / "designs" / "mini20.yaml"
    assert main(["bundle", str(spec), "--no-ladder", "-o", str(bundle)]) == 0
    text = (SCENES / "press_ring.yaml").read_text()
    plans = []
    for line in (f"spec: {spec}", f"bundle: {bundle}"):
        scene = tmp_path / "scene.yaml"
        scene.write_text(text.replace("spec: ../gelslim2.yaml", line))
        capsys.readouterr()
        assert main(["plan", str(scene), "--json"]) == 0
        plans.append(json.loads(capsys.readouterr().out))
    for one, other in zip(plans[0]["effects"], plans[1]["effects"], strict=True):
        assert one["included"] == other["included"]
        assert one["rung"] == other["rung"]
        assert one["size"] == pytest.approx(other["size"], rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("../gelslim2.yaml", "gone.yaml", "scene.yaml:5 sensor.spec = gone.yaml: "),
        ("spec: ../gelslim2.yaml", "bundle: gone", "sensor.bundle = gone: "),
        ("outer_radius_mm: 6", "outer_radius_mm: 4", "outer_radius_mm (4)"),
        ("drawing: {contrast: 0.93}", "drawing: off", "effects.drawing"),
    ],
)
def test_bad_scenes_are_refused_in_one_line(tmp_path, capsys, old, new, words):
    text = (SCENES / "press_ring.yaml").read_text()
    assert text.count(old) == 1
    # The sensor's path is relative to the scene.
    (tmp_path / "scenes").mkdir()
    spec = (ROOT / "designs" / "gelslim2.yaml").read_text()
    (tmp_path / "gelslim2.yaml").write_text(spec)
    scene = tmp_path / "scenes" / "scene.yaml"
    scene.write_text(text.replace(old, new))
    assert main(["plan", str(scene)]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said
    assert len(said.splitlines()) == 1


def test_the_schema_of_scenes_is_printed(capsys):
    assert main(["schema", "--scene"]) == 0
    committed = ROOT / "docs" / "gelslim-scene-1.schema.json"
    assert capsys.readouterr().out == committed.read_text(encoding="utf-8")


def test_a_bundle_that_is_none_is_refused(tmp_path, capsys):
    (tmp_path / "b").mkdir()
    scene = tmp_path / "scene.yaml"
    text = (SCENES / "press_ring.yaml").read_text()
    scene.write_text(text.replace("spec: ../gelslim2.yaml", "bundle: b"))
    assert main(["plan", str(scene)]) == 2
    said = capsys.readouterr().err
    assert str(Path(tmp_path) / "b") in said
    assert "Traceback" not in said
