"""A bundle is the whole sensor, whichever command made it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gelslim
from gelslim.cli import main
from gelslim_cad.build.writers import WRITERS
from gelslim_cad.spec import Spec
from gelslim_core.budget.budget import Budget, BudgetError
from gelslim_optics.light.light_map import LightMap
from gelslim_twin.simulation.sensor import TwinSensor
from ifem_export.bundle.bundle import Bundle
from ifem_export.bundle.files import load_bundle

MINI20 = Path(__file__).parents[2] / "designs" / "mini20.yaml"


@pytest.fixture(scope="module")
def spec_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finger with a coarse mesh of oblong cells."""
    path = tmp_path_factory.mktemp("spec") / "coarse.yaml"
    text = MINI20.read_text(encoding="utf-8").replace("name: mini20", "name: coarse")
    path.write_text(text + "mesh: {cells_along: 14, cells_across: 10, layers: 2}\n")
    return path


@pytest.fixture(scope="module")
def built(spec_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bundle as `gelslim build` writes it."""
    spec = gelslim.read_spec(spec_file).spec
    written = WRITERS["bundle"]((), spec=spec.model_dump_json())
    folder = tmp_path_factory.mktemp("built")
    for name, (data, _) in written.files.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(data)
    return folder / "bundle"


@pytest.fixture(scope="module")
def measured(spec_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bundle as `gelslim bundle` writes it, with times."""
    folder = tmp_path_factory.mktemp("measured") / "bundle"
    assert main(["bundle", str(spec_file), "-o", str(folder), "--json"]) == 0
    return folder


@pytest.mark.slow
def test_build_and_bundle_write_the_same_but_for_the_times(built: Path, measured: Path) -> None:
    one, other = load_bundle(built), load_bundle(measured)
    assert one.ladder is not None
    assert other.ladder is not None
    assert all(rung.milliseconds is None for rung in one.ladder.rungs)
    assert all(rung.milliseconds > 0 for rung in other.ladder.rungs)  # type: ignore[operator]
    assert one.ladder == other.ladder.untimed()
    assert one.operator == other.operator
    names = {p.name for p in built.iterdir()} - {"pad.vtu"}
    assert names == {p.name for p in measured.iterdir()}
    for name in sorted(names - {"ladder.json", "manifest.json"}):
        assert (built / name).read_bytes() == (measured / name).read_bytes(), name


def test_an_error_is_kept_without_times_and_a_time_asks_for_them(built: Path) -> None:
    bundle = load_bundle(built)
    assert bundle.ladder is not None
    most = max(rung.error_field for rung in bundle.ladder.rungs)
    operator = bundle.surface_operator(budget=Budget(error=min(most, 1.0)))
    assert operator.n_bytes > 0
    with pytest.raises(BudgetError):
        bundle.surface_operator(budget=Budget(time_ms=1.0))
    timed = replace(bundle, ladder=bundle.ladder.timed({r.label: 1.0 for r in bundle.ladder.rungs}))
    assert timed.surface_operator(budget=Budget(time_ms=2.0)).n_bytes > 0


def test_outline_tolerances_and_light_come_back(built: Path, spec_file: Path) -> None:
    bundle, spec = load_bundle(built), gelslim.read_spec(spec_file).spec
    gel = spec.design.gel
    assert bundle.outline is not None
    assert (bundle.outline.length_mm, bundle.outline.width_mm) == (gel.length_mm, gel.width_mm)
    material = spec.material.gel
    expected = material.youngs_modulus_tolerance_ratio * material.youngs_modulus_mpa
    assert bundle.tolerances["youngs_modulus_mpa"] == pytest.approx(expected)
    assert bundle.tolerances["thickness_mm"] > 0
    light = TwinSensor(bundle).light()
    assert isinstance(light, LightMap)
    # The finger is symmetric: red from one side is the mirror image of green from the other.
    across = light.irradiance.mean(axis=1)
    assert np.corrcoef(across[::-1, 0], across[:, 1])[0, 1] > 0.95
    assert np.ptp(across[:, 0]) > 0.1 * across[:, 0].mean()


@pytest.mark.slow
def test_a_bundle_without_the_new_parts_still_serves(measured: Path) -> None:
    bundle: Bundle = replace(load_bundle(measured), outline=None, tolerances={}, light={})
    sensor = TwinSensor(bundle)
    box = np.ptp(sensor.points_mm, axis=0)
    assert sensor.size_mm == pytest.approx((box[0], box[1]))
    assert sensor.light().sources == 2


def test_a_scene_with_a_bundle_has_the_light_of_its_guide(measured: Path, tmp_path: Path) -> None:
    scene = tmp_path / "touch.yaml"
    scene.write_text(
        f"format: gelslim-scene/1\nname: touch\nsensor: {{bundle: {measured}}}\n"
        "indenters: [{shape: sphere, radius_mm: 5}]\n"
        "motion: {waypoints: [{move: press, depth_mm: 0.2, steps: 1, duration_s: 0.1}]}\n"
        "observe: [force, image]\n"
    )
    gelslim.simulate(scene, tmp_path / "out")
    kept = load_bundle(tmp_path / ".sensor" / "bundle")
    assert kept.light.keys() == load_bundle(measured).light.keys()
    assert list((tmp_path / "out" / "frames").glob("*.png"))


def test_a_spec_is_whole_in_a_unit_of_work(spec_file: Path) -> None:
    spec = gelslim.read_spec(spec_file).spec
    assert Spec.model_validate_json(spec.model_dump_json()) == spec
