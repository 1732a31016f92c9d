"""A gel without markers: parts, light and boards are made; what needs markers says so."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from gelslim_cad.checks import RULES, check, margins_batch
from gelslim_cad.checks.explain import UnknownNameError, explain
from gelslim_cad.dimensions import Dimensions, derive, derive_batch
from gelslim_cad.explore.space import Axis, Space
from gelslim_cad.explore.study import Request, explore
from gelslim_cad.sensor import NoMarkersError, marker_grid, printed_grid
from gelslim_cad.spec.reader import LoadedSpec, read_spec
from gelslim_cad.tolerance.study import tolerance_study
from gelslim_core.jobs import Engine

MARKED = (Path(__file__).parents[2] / "designs" / "mini20.yaml").read_text()
SCENE = """\
format: gelslim-scene/1
name: press
sensor: {spec: plain.yaml}
indenters: [{shape: sphere, radius_mm: 4}]
motion: {waypoints: [{move: press, depth_mm: 0.3}]}
observe: [force]
"""


def unmarked(text: str = MARKED) -> str:
    """The spec with `markers: none` in place of its block."""
    lines, skipping = [], False
    for line in text.splitlines():
        if line.startswith("  markers:"):
            lines.append("  markers: none")
            skipping = True
        elif not (skipping and line.startswith("    ")):
            skipping = False
            lines.append(line)
    return "\n".join(lines) + "\n"


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> LoadedSpec:
    path = tmp_path_factory.mktemp("spec") / "plain.yaml"
    path.write_text(unmarked())
    return read_spec(path)


@pytest.fixture(scope="module")
def d(plain: LoadedSpec) -> Dimensions:
    return derive(plain.spec)


def test_the_word_none_and_the_pattern_none_are_one_spec(tmp_path: Path, plain: LoadedSpec) -> None:
    other = tmp_path / "spelt.yaml"
    other.write_text(unmarked().replace("markers: none", "markers: {pattern: none}"))
    assert read_spec(other).spec == plain.spec
    assert plain.spec.design.markers.pattern == "none"


def test_no_grid_is_made_and_asking_for_one_names_field_and_remedy(d: Dimensions) -> None:
    assert printed_grid(d) is None
    assert d["marker_grid.rows"] == d["marker_grid.columns"] == 0
    with pytest.raises(NoMarkersError) as caught:
        marker_grid(d)
    found = caught.value.to_dict()
    assert (found["field"], found["value"]) == ("design.markers.pattern", "none")
    assert found["error"] == "no markers"
    assert "set design.markers.pattern: grid" in found["remedy"]


def test_rules_on_markers_and_mesh_are_left_out_and_no_other(
    plain: LoadedSpec, d: Dimensions
) -> None:
    of_markers = {name for name, rule in RULES.items() if rule.of_markers}
    assert {"marker.diameter_mm", "marker.lattice", "mesh.size"} <= of_markers
    assert {c.id for c in check(d)} == set(RULES) - of_markers
    batch = margins_batch(derive_batch(plain.spec, {"design.gel.length_mm": [20.0, 21.0]}))
    assert set(batch) == set(RULES) - of_markers
    with pytest.raises(UnknownNameError, match="no markers"):
        explain(plain, d, "marker.diameter_mm")


def test_blur_and_pixels_are_still_judged_on_the_detail_that_is_asked_for(
    plain: LoadedSpec, d: Dimensions
) -> None:
    finer = derive(
        plain.spec.model_validate(
            {
                **plain.spec.model_dump(),
                "design": {
                    **plain.spec.design.model_dump(),
                    "markers": {"pattern": "none", "diameter_mm": 0.25},
                },
            }
        )
    )
    ids = {c.id for c in check(d)}
    assert {"blur.gel", "marker.far_px"} <= ids
    assert finer["view.blur_limit_mm"] == pytest.approx(
        d["view.blur_limit_mm"] * 0.25 / d["design.markers.diameter_mm"]
    )


def test_tolerances_have_no_forces_and_no_marker_in_the_picture(plain: LoadedSpec) -> None:
    study = tolerance_study(plain.spec, samples=64)
    assert study.forces == ()
    assert "coverage.markers" not in study.yields[study.stage]
    assert "coverage.along" in study.yields[study.stage]


def test_a_force_error_cannot_be_explored(plain: LoadedSpec, tmp_path: Path) -> None:
    space = Space(plain.spec, (Axis("design.gel.length_mm", (20.0, 21.0)),))
    with pytest.raises(NoMarkersError):
        explore(Request(space, force_error=True), tmp_path / "table", Engine(1))


@pytest.mark.parametrize("command", [["bundle"], ["markers"]])
def test_commands_that_need_markers_refuse_with_status_2(
    command: list[str], plain: LoadedSpec, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from gelslim.cli.main import main

    assert main([*command, plain.path, "--out", str(tmp_path / "out")]) == 2
    assert "design.markers.pattern = none" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", ["plan", "simulate"])
def test_a_scene_refuses_with_the_same_words(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from gelslim.cli.main import main

    (tmp_path / "plain.yaml").write_text(unmarked())
    scene = tmp_path / "press.yaml"
    scene.write_text(SCENE)
    assert main([command, str(scene)]) == 2
    assert "design.markers.pattern = none" in capsys.readouterr().err


@pytest.mark.slow
def test_a_build_has_everything_but_what_needs_markers(
    tmp_path: Path, plain: LoadedSpec, built: Path
) -> None:
    pytest.importorskip("cadquery", reason="building needs the [cad] extra")
    from gelslim_cad.build import build_variant

    result = build_variant(plain.path, tmp_path / "plain", jobs=1)
    (sentence,) = result.left_out
    assert "no bundle" in sentence
    assert "design.markers.pattern" in sentence
    marked = set(json.loads((built / "manifest.json").read_text())["files"])
    missing = marked - set(result.files)
    assert missing == {p for p in marked if p.startswith(("markers/", "bundle/"))} | {
        f for f in marked if f.startswith(("mini20", "step/mini20"))
    } - set(result.files)
    with (tmp_path / "plain" / "BOM.csv").open() as stream:
        bought = {row["part"] for row in csv.DictReader(stream)}
    assert "marker_stencil" not in bought
    assert {"gel_pad", "cutting_template"} <= bought
    again = build_variant(plain.path, tmp_path / "plain", jobs=1)
    assert again.up_to_date
    assert again.left_out == result.left_out
