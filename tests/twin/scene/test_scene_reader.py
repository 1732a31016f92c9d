"""Scenes are read whole or refused with line, value, limit and remedy."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from ruamel.yaml import YAML
from sampled import quick
from scene_samples import GALLERY, MINIMAL, ROOT, load, problems, random_scene

from gelslim_core.yaml.errors import InputError, Problem
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.scene.reader import read_scene, scene_schema_text
from gelslim_twin.scene.scene import Effects


def only(folder: Path, text: str) -> str:
    found = problems(folder, text)
    assert len(found) == 1, [str(p) for p in found]
    return str(found[0]).replace(str(folder / "scene.yaml"), "S")


def test_a_minimal_scene_has_quiet_defaults(tmp_path):
    scene = load(tmp_path, MINIMAL).scene
    assert scene.contact.friction == 0
    assert scene.seed == 0
    assert {p.use for p in scene.effects.parameters().values()} == {"auto"}


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("radius_mm: 8", "radius_mm: -8", "S:6 indenters[0].radius_mm = -8: must be > 0"),
        (
            "radius_mm: 8",
            "radius: 8",
            "S:6 indenters[0].radius = 8: unknown field; did you mean ind",
        ),
        ("shape: sphere", "shape: sphre", "S:5 indenters[0].shape = sphre: must be sphere, cyl"),
        ("move: press", "move: pres", "S:9 motion.waypoints[0].move = pres: must be press, shear"),
        ("depth_mm: 0.5", "depth_mm: 50", "S:9 motion.waypoints[0].depth_mm = 50: must be <= 20"),
        (
            "observe: [force]",
            "observe: [forse]",
            "S:10 observe[0] = forse: must be displacement, force, markers",
        ),
        ("observe: [force]", "observe: [force, force]", "S:10 observe[1] = force: force is listed"),
        ("scene/1", "scene/2", "S:1 format = gelslim-scene/2: newer than this program"),
        ("spec: finger.yaml", "", "S:3 sensor: names neither spec nor bundle; add"),
        (
            "spec: finger.yaml",
            "spec: a, bundle: b",
            "S:3 sensor.bundle = b: given beside spec, a scene has one sensor; delete one",
        ),
    ],
)
def test_faults_are_named_with_line_value_and_remedy(tmp_path, old, new, expected):
    assert MINIMAL.count(old) == 1
    assert only(tmp_path, MINIMAL.replace(old, new)).startswith(expected)


@pytest.mark.parametrize(
    ("effects", "expected"),
    [
        ("friction: of", "S:12 effects.friction = of: must be"),
        (
            "fricton: off",
            "S:12 effects.fricton = off: unknown field; did you mean effects.fr",
        ),
        (
            "relaxation: {terms: [{fraction: 1.5, time_s: 1}]}",
            "S:12 effects.relaxation.terms[0]",
        ),
        (
            "relaxation: {terms: [{fraction: 0.6, time_s: 1}, {fraction: 0.5, time_s: 2}]}",
            "S:12 effects.relaxation.terms: have fractions that sum to 1.1, must be below 1",
        ),
        (
            "{relaxation: {terms: [{fraction: 0.1, time_s: 1}]},"
            " viscoelasticity: {terms: [{fraction: 0.2, time_s: 1}]}}",
            "S:12 effects.viscoelasticity.terms: are given beside those of relaxation",
        ),
        ("compression: {quality: 400}", "S:12 effects.compression.quality = 400: must be <= 95"),
    ],
)
def test_faults_of_overrides(tmp_path, effects, expected):
    assert only(tmp_path, f"{MINIMAL}effects:\n  {effects}\n").startswith(expected)


def test_an_empty_scene_points_to_the_gallery(tmp_path):
    assert "designs/scenes" in only(tmp_path, "# nothing\n")


def test_a_missing_stl_is_blamed_on_its_line(tmp_path):
    text = MINIMAL.replace("  - shape: sphere\n    radius_mm: 8", "  - shape: stl\n    file: a.stl")
    assert only(tmp_path, text).startswith("S:6 indenters[0].file = a.stl: no such file")
    (tmp_path / "a.stl").write_bytes(b"PNG, not a mesh")
    assert "is no STL file" in only(tmp_path, text)


def test_a_bare_word_and_a_block_with_use_are_the_same(tmp_path):
    word = load(tmp_path, f"{MINIMAL}effects: {{friction: off}}\n").scene
    block = load(tmp_path, f"{MINIMAL}effects: {{friction: {{use: off}}}}\n").scene
    assert word.effects.parameters() == block.effects.parameters()
    assert word.effects.parameters()["friction"].use == "off"


def test_every_effect_has_its_field_and_its_parameters():
    assert [e.name for e in EFFECTS] == list(Effects.model_fields)
    for effect in EFFECTS:
        assert type(Effects().parameters()[effect.name]) is effect.parameters


@cache
def schema() -> Any:
    """The validator of scenes; the schema itself is checked once."""
    made = json.loads(scene_schema_text())
    kind = jsonschema.validators.validator_for(made)
    kind.check_schema(made)
    return kind(made)


def fits_the_schema(scene: Any) -> None:
    schema().validate(scene)


@pytest.mark.parametrize("path", GALLERY, ids=lambda p: p.stem)
def test_gallery_scenes_read_and_fit_the_schema(path):
    loaded = read_scene(path)
    assert loaded.scene.name == path.stem
    assert loaded.sensor_path.resolve().is_file()
    assert path.read_text().startswith("#")
    fits_the_schema(YAML(typ="safe").load(path.read_text()))


def test_the_gallery_is_large_enough_and_shows_every_kind():
    scenes = [read_scene(path).scene for path in GALLERY]
    assert len(scenes) >= 8
    shapes = {i.shape for s in scenes for i in s.indenters}
    assert shapes >= {"sphere", "cylinder", "ring", "flat_punch", "wedge", "cone", "textured_plane"}
    moves = {w.move for s in scenes for w in s.motion.waypoints or ()}
    assert moves == {"press", "shear", "twist", "tilt", "slide", "hold", "release"}


def test_the_committed_schema_matches_the_models():
    committed = ROOT / "docs" / "gelslim-scene-1.schema.json"
    assert committed.read_text(encoding="utf-8") == scene_schema_text(), (
        f"the models changed: `gelslim schema --scene > docs/{committed.name}`"
    )


@pytest.mark.parametrize("seed", quick(range(40), lambda seed: seed < 12))
def test_random_scenes_read_and_fit_the_schema(tmp_path, seed):
    text = random_scene(seed)
    loaded = load(tmp_path, text)
    times = [p.time_s for p in loaded.poses]
    assert (np.diff(times) > 0).all()
    fits_the_schema(json.loads(text))


@pytest.mark.parametrize("seed", range(60))
def test_spoilt_scenes_are_refused_without_a_traceback(tmp_path, seed):
    random = np.random.default_rng(seed)
    lines = MINIMAL.splitlines()
    at = int(random.integers(len(lines)))
    cut = int(random.integers(len(lines[at]) + 1))
    lines[at] = lines[at][:cut] + str(random.choice(["&a", ": :", "\t", "[", "nan", "'", "1e999"]))
    found: tuple[Problem, ...] = ()
    try:
        load(tmp_path, "\n".join(lines) + "\n")
    except InputError as error:
        found = error.problems
    assert all(p.message and p.remedy for p in found)
