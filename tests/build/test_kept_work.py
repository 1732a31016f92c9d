"""Work that a build takes over from the last one is exactly that whose inputs are unchanged."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

pytest.importorskip("cadquery", reason="building needs the [cad] extra")

import cadquery as cq

from gelslim_cad.build import BuildRefusedError, build_variant
from gelslim_cad.build.kept_checks import KeptChecks, last_checks, solid_checks
from gelslim_cad.build.manifest import Manifest, entry
from gelslim_cad.build.stages import Stages
from gelslim_cad.build.variant import _with_known
from gelslim_cad.build.work import Unit
from gelslim_cad.build.writers import LADDER_JSON
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.part import Part
from gelslim_cad.sensor import ladder_inputs, marker_grid, marker_inputs, marker_print, pad_mesh
from gelslim_cad.spec.reader import read_spec

SPEC = Path(__file__).parents[2] / "designs" / "mini20.yaml"
CHANGES: Mapping[str, tuple[float, float]] = {
    "material.gel.youngs_modulus_mpa": (0.12, 0.2),
    "material.gel.refractive_index": (1.40, 1.42),
    "design.markers.diameter_mm": (0.58, 0.66),
    "design.markers.pitch_mm": (1.05, 1.15),
    "design.gel.thickness_mm": (1.9, 2.1),
    "design.gel.corner_radius_mm": (1.2, 1.8),
    "design.housing.back_wall_mm": (1.1, 1.4),
    "design.mirror.border_mm": (0.5, 0.8),
    "manufacturing.kerf.film_mm": (0.05, 0.1),
    "manufacturing.gel_thickness_tolerance_mm": (0.02, 0.06),
}
"""Fields with values that this design is built with."""


def changed(path: str, value: float, at: Path) -> Path:
    """The spec with another value of a field, written to a file."""
    content = yaml.safe_load(SPEC.read_text("utf-8"))
    *blocks, last = path.split(".")
    inner: dict[str, Any] = content
    for block in blocks:
        inner = inner.setdefault(block, {})
    inner[last] = value
    at.write_text(yaml.safe_dump(content), "utf-8")
    return at


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_rebuilt_folder_equals_one_that_is_built_cold(
    built: Path, tmp_path: Path, digests: Callable[[Path], dict[str, str]], seed: int
) -> None:
    """Two random changes after each other, the second without the first."""
    draw = random.Random(seed)
    folder = tmp_path / "kept"
    shutil.copytree(built, folder)
    rebuilt: list[set[str]] = []
    for path in draw.sample(sorted(CHANGES), 2):
        spec = changed(path, round(draw.uniform(*CHANGES[path]), 4), tmp_path / "mini20.yaml")
        try:
            rebuilt.append(set(build_variant(spec, folder, jobs=2).rebuilt))
        except BuildRefusedError:
            continue
        cold = tmp_path / "cold"
        shutil.rmtree(cold, ignore_errors=True)
        build_variant(spec, cold, jobs=2)
        assert digests(folder) == digests(cold), path
    assert rebuilt


def dimensions() -> Dimensions:
    return derive(read_spec(SPEC).spec)


def early_keys(spec: Path) -> dict[str, str]:
    """Keys of the units that need no solids, and of their files with keys of their own."""
    units = Stages.prepare(read_spec(spec)).units_without_solids
    return {u.name: u.key() for u in units} | {p: k for u in units for p, k in u.file_keys}


@pytest.mark.parametrize(
    ("path", "value", "kept"),
    [
        ("material.gel.youngs_modulus_mpa", 0.151, {"light", "view"}),
        ("design.housing.back_wall_mm", 1.3, {LADDER_JSON, "light", "view"}),
        ("manufacturing.gel_thickness_tolerance_mm", 0.04, {LADDER_JSON, "light", "view"}),
        ("design.markers.pitch_mm", 1.11, {"light", "view"}),
    ],
)
def test_keys_follow_the_inputs_of_what_they_stand_for(
    tmp_path: Path, path: str, value: float, kept: set[str]
) -> None:
    before, after = early_keys(SPEC), early_keys(changed(path, value, tmp_path / "one.yaml"))
    assert {name for name in before if after[name] == before[name]} == kept


def test_the_ladder_and_the_drawings_need_no_other_value() -> None:
    """Mesh and markers from these values alone are those from all dimensions."""
    d = dimensions()
    few, all_of_them = (pad_mesh(v, marker_grid(v))[0] for v in (ladder_inputs(d), d))
    np.testing.assert_array_equal(few.nodes_mm, all_of_them.nodes_mm)
    np.testing.assert_array_equal(few.occupancy, all_of_them.occupancy)
    drawn, grid = marker_grid(marker_inputs(d)), marker_grid(d)
    np.testing.assert_array_equal(drawn.positions_mm, grid.positions_mm)
    assert len(marker_print(d, grid)[0].node_id) == len(drawn)


def kept_manifest(files: Mapping[str, bytes], keys: Mapping[str, str]) -> Manifest:
    made = {path: entry(data, "test", "unit") for path, data in files.items()}
    return Manifest("n", "h", "k", {}, keys, made)


def test_only_intact_files_with_the_same_key_are_known(tmp_path: Path) -> None:
    files = {"same.txt": b"1", "other_key.txt": b"2", "damaged.txt": b"3"}
    keys = {"same.txt": "a", "other_key.txt": "b", "damaged.txt": "c", "never_written.txt": "d"}
    for path, data in files.items():
        (tmp_path / path).write_bytes(data)
    manifest = kept_manifest(files, keys)
    (tmp_path / "damaged.txt").write_bytes(b"4")
    asked = {**keys, "other_key.txt": "B"}
    unit = Unit("unit", "view", file_keys=tuple(asked.items()))
    assert dict(_with_known(unit, manifest, tmp_path).known) == {"same.txt": b"1"}
    assert _with_known(unit, None, tmp_path).known == ()
    assert _with_known(unit, manifest, tmp_path).key() == unit.key()


def test_rules_on_solids_hold_until_a_solid_or_a_value_that_they_read_changes() -> None:
    d = dimensions()
    block = Part("block", cq.Solid.makeBox(1, 1, 1), "steel", "buy", (0.5, 0.5, 0.5, 1.0))
    found = solid_checks("solids", d, [block])
    assert {c.id for c in found.checks} >= {"view.line_of_sight", "mould.wall_mm"}
    again = last_checks(replace(kept_manifest({}, {}), solid_checks=found.record()))
    assert again == found
    assert again.hold("solids", d)
    assert not again.hold("other solids", d)
    assert "material.gel.youngs_modulus_mpa" not in found.names
    softer = replace(d, given={**d.given, "material.gel.youngs_modulus_mpa": 0.1})
    assert again.hold("solids", softer)
    for name in found.names:
        values = d.values if name in d.values else d.given
        if not isinstance(values[name], float):
            continue
        other = {**values, name: values[name] + 1e-9}
        nudged = replace(d, values=other) if values is d.values else replace(d, given=other)
        assert not again.hold("solids", nudged), name


@pytest.mark.parametrize("record", [{}, {"key": "k"}, {"key": "k", "names": [], "checks": [{}]}])
def test_results_that_cannot_be_read_are_found_again(record: dict[str, Any]) -> None:
    assert last_checks(replace(kept_manifest({}, {}), solid_checks=record)) is None
    assert last_checks(None) is None
    assert KeptChecks("k", (), ()).record() == {"key": "k", "names": [], "checks": []}
