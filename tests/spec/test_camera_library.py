"""Cameras of the library: figures with sources, and specs that take them."""

import math
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from pydantic import ValidationError
from ruamel.yaml import YAML
from sampled import quick

from gelslim_cad.checks import check
from gelslim_cad.dimensions import derive
from gelslim_cad.explore.space import changed, illegal
from gelslim_cad.spec import Spec
from gelslim_cad.spec.camera import LIBRARY, camera_names
from gelslim_cad.spec.camera_library import (
    CameraLibraryError,
    LibraryCamera,
    lend_fields,
    library_camera,
)
from gelslim_cad.spec.reader import read_spec
from gelslim_cad.spec.reference import schema_text
from gelslim_cad.spec.starter import starter_text
from gelslim_core.yaml.errors import InputError, Problem
from gelslim_core.yaml.reader import Loaded, load_bytes

TEXT = """\
format: gelslim-spec/1
name: finger
camera:
  model: ov9281
  mode: 640x400
design:
  gel: {length_mm: 24, width_mm: 22}
"""
MODES = [(name, mode.name) for name in camera_names() for mode in library_camera(name).modes]


def load(text: str = TEXT) -> Loaded[Spec]:
    return load_bytes("finger.yaml", text.encode(), Spec, lend_fields)


def problem(text: str) -> Problem:
    with pytest.raises(InputError) as caught:
        load(text)
    (found,) = caught.value.problems
    return found


@pytest.mark.parametrize(("name", "mode"), MODES)
def test_every_mode_is_a_camera_whose_sensor_is_its_pixels(name, mode):
    entry = library_camera(name)
    chosen = next(m for m in entry.modes if m.name == mode)
    camera = load(TEXT.replace("ov9281", name).replace("640x400", mode)).model.camera
    assert (camera.model, camera.mode) == (name, mode)
    side_mm = camera.image_width_px * chosen.binning * entry.pixel_um * 1e-3
    assert camera.sensor_width_mm == pytest.approx(side_mm)
    assert camera.sensor_height_mm <= entry.sensor_px[1] * entry.pixel_um * 1e-3 + 1e-9
    assert camera.frame_rate_hz == chosen.frame_rate_hz
    # Skipping and binning change the picture, but the field of view only where it is cut out.
    half = math.tan(math.radians(entry.implied_fov_deg()["horizontal_deg"]) / 2)
    part = chosen.crop_px[0] / entry.sensor_px[0]
    assert camera.sensor_width_mm / 2 / camera.focal_length_mm == pytest.approx(part * half)


@pytest.mark.parametrize("name", camera_names())
def test_every_figure_has_one_source_and_a_field_of_view_agrees_with_f(name):
    entry = library_camera(name)
    for figure in entry.figures:
        assert sum(figure in source.gives for source in entry.sources) == 1, figure
        assert entry.source(figure).text
    view = entry.field_of_view
    if view is not None and not view.deviation:
        for key, implied in entry.implied_fov_deg().items():
            given = getattr(view, key)
            assert given is None or given == pytest.approx(implied, rel=0.05), key


def test_known_sheets():
    v2 = library_camera("imx219_v2").fields("640x480")
    # The mode of 640 x 480 pixels shows the middle 1280 x 960 of 1.12 um.
    assert v2["sensor_width_mm"] == pytest.approx(1.4336)
    assert library_camera("ov9281").fields()["picture"] == "mono"
    assert [library_camera(n).shutter for n in ("ov9281", "imx219_v2")] == ["global", "rolling"]


def broken(old: str, new: str) -> str:
    text = (LIBRARY / "ovm6211.yaml").read_text(encoding="utf-8")
    assert old in text
    return text.replace(old, new)


@pytest.mark.parametrize(
    "text",
    [
        broken("camera.f_number, ", ""),
        broken("gives: [field_of_view,", "gives: [field_of_view, connector,"),
        broken("horizontal_deg: 40", "horizontal_deg: 44"),
        broken("diagonal_deg: 54", "diagonal_deg: 54, deviation: none"),
        broken("crop_px: [400, 400]", "crop_px: [800, 800]"),
        broken("image_px: [400, 400]", "image_px: [200, 400]"),
        broken("f_number: 2.88", "f_number: 0.1"),
        broken("f_number: 2.88", "f_stop: 2.88"),
    ],
    ids=["unsourced", "twice", "field", "excuse", "crop", "square", "range", "name"],
)
def test_a_file_that_is_not_consistent_is_refused(text):
    with pytest.raises(InputError):
        load_bytes("camera.yaml", text.encode(), LibraryCamera)


def test_the_first_mode_is_the_default_and_written_fields_prevail():
    plain = load(TEXT.replace("  mode: 640x400\n", "  f_number: 4\n"))
    camera = plain.model.camera
    assert (camera.mode, camera.image_width_px, camera.f_number) == ("1280x800", 1280, 4.0)
    assert "camera.f_number" in plain.source_map
    assert "camera.f_number" not in plain.lent
    assert "ov9281" in plain.lent["camera.focal_length_mm"]
    assert not {"camera.focal_length_mm", "camera.mode"} & {*plain.source_map, *plain.defaulted}
    assert "camera.lens_transmission" in plain.defaulted


def test_a_fixed_lens_that_is_taken_to_be_movable_loses_its_distance():
    text = TEXT.replace("model: ov9281\n  mode: 640x400", "model: ovm6211\n  focusing: unit")
    camera = load(text).model.camera
    assert (camera.focusing, camera.focus_distance_mm) == ("unit", None)
    assert load(text.replace("  focusing: unit\n", "")).model.camera.focus_distance_mm == 40


def test_a_spec_is_the_same_with_the_fields_of_the_library_written_out(tmp_path: Path):
    loaded = load()
    assert Spec.model_validate_json(loaded.model.model_dump_json()) == loaded.model
    assert Spec.model_validate(YAML(typ="safe").load(TEXT)) == loaded.model
    (tmp_path / "finger.yaml").write_text(TEXT, encoding="utf-8")
    read = read_spec(tmp_path / "finger.yaml")
    assert read.spec == loaded.model
    assert "ov9281" in read._repr_html_()


@pytest.mark.parametrize(
    ("old", "new", "field", "line"),
    [
        ("model: ov9281", "model: ov9821", "camera.model", 4),
        ("model: ov9281", "model: 9281", "camera.model", 4),
        ("mode: 640x400", "mode: 640x401", "camera.mode", 5),
        ("mode: 640x400", "mode: 640", "camera.mode", 5),
        ("mode: 640x400", "focal_lenght_mm: 3", "camera.focal_lenght_mm", 5),
        ("mode: 640x400", "f_number: 0.1", "camera.f_number", 5),
    ],
)
def test_faults_name_line_and_field(old, new, field, line):
    found = problem(TEXT.replace(old, new))
    assert (found.field, found.line) == (field, line)


def test_unknown_names_are_told_what_there_is():
    assert "ov9281" in problem(TEXT.replace("ov9281", "ov9821")).remedy
    far = problem(TEXT.replace("ov9281", "zzz")).remedy
    assert all(name in far for name in camera_names())
    with pytest.raises(CameraLibraryError, match="ov9281"):
        library_camera("ov9821")


def test_a_rule_that_a_field_of_the_library_breaks_names_the_camera():
    # The lens of 14 mm is the library's; the width that it exceeds stands on line 5.
    found = problem(TEXT.replace("mode: 640x400", "module_width_mm: 12"))
    assert (found.field, found.value, found.line) == ("camera.lens_diameter_mm", "14", 5)
    assert "ov9281" in found.message
    found = problem(TEXT.replace("mode: 640x400", "focus_distance_mm: 30"))
    assert (found.field, found.line) == ("camera.focus_distance_mm", 5)
    assert "ov9281" not in found.message


def test_the_schema_lets_a_model_stand_for_the_required_fields():
    schema = Draft202012Validator(YAML(typ="safe").load(schema_text()))
    content = YAML(typ="safe").load(TEXT)
    assert schema.is_valid(content)
    content["camera"]["model"] = "ov9821"
    assert not schema.is_valid(content)
    del content["camera"]["model"]
    assert not schema.is_valid(content)


def test_another_camera_or_mode_brings_its_fields_along():
    spec = load(TEXT.replace("mode: 640x400", "f_number: 4")).model
    other = changed(spec, {"camera.model": "imx219_v2"}).camera
    assert (other.mode, other.focal_length_mm, other.f_number) == ("1640x1232", 3.04, 4.0)
    assert other.picture == "colour"
    binned = changed(spec, {"camera.mode": "640x400"}).camera
    assert (binned.image_width_px, binned.sensor_width_mm) == (640, 3.84)
    assert changed(spec, {"camera.focal_length_mm": 2.0}).camera.focal_length_mm == 2.0
    written = Spec.model_validate(YAML(typ="safe").load(TEXT))
    plain = written.model_copy(
        update={"camera": written.camera.model_copy(update={"model": None, "mode": None})}
    )
    assert changed(plain, {"camera.model": "ov5647_spy"}).camera.focal_length_mm == 3.6
    assert illegal(spec, {"camera.model": "none such"}).startswith("camera")
    with pytest.raises(ValidationError):
        changed(plain, {"camera.mode": "640x400"})


STARTED = ("gelsight_mini_like", "imx708_wide", "ov5647_spy", "ov9281")
"""Tried in every run; the slow run has the others."""


@pytest.mark.parametrize("name", quick(camera_names(), STARTED.__contains__))
def test_the_starter_of_every_camera_lets_its_cable_out(name):
    loaded = load_bytes("mine.yaml", starter_text("mine", model=name).encode(), Spec, lend_fields)
    cable = [c for c in check(derive(loaded.model)) if c.id.startswith("cable.")]
    assert len(cable) >= 6
    assert [c.id for c in cable if c.status == "fail"] == []
