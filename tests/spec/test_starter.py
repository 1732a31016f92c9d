"""The starter spec reads back, as it stands and with every comment mark deleted."""

import re

import pytest

from gelslim_cad.spec.spec import Spec
from gelslim_cad.spec.starter import starter_text
from gelslim_core.yaml.errors import InputError
from gelslim_core.yaml.fields import field_table
from gelslim_core.yaml.reader import Loaded, load_bytes


def load(text: str) -> Loaded[Spec]:
    return load_bytes("starter.yaml", text.encode(), Spec)


MARK = re.compile(r"^( *)# (?=[ a-z])", re.MULTILINE)


def test_it_reads_back_with_the_values_asked_for():
    spec = load(starter_text("my_finger", gel_length_mm=30, gel_width_mm=18.5)).model
    assert spec.name == "my_finger"
    assert (spec.design.gel.length_mm, spec.design.gel.width_mm) == (30, 18.5)
    assert (spec.camera.image_width_px, spec.camera.f_number) == (640, 2.9)
    # 1.4 µm pixels, 2592 x 1944 of them.
    assert spec.camera.sensor_width_mm == pytest.approx(2592 * 1.4e-3)
    assert spec.camera.sensor_height_mm == pytest.approx(1944 * 1.4e-3)


def test_with_every_mark_deleted_it_is_the_same_spec_with_every_field_given():
    text = starter_text("my_finger")
    loaded, full = load(text), load(MARK.sub(r"\1", text))
    assert full.model == loaded.model
    assert full.defaulted == ()
    assert len(loaded.defaulted) > 50
    assert set(full.source_map) >= {field.path for field in field_table(Spec)}


def test_every_field_stands_there_with_its_description():
    text = starter_text("my_finger")
    for field in field_table(Spec):
        assert re.search(rf"{field.name}:.*  # {re.escape(field.description)}", text), field.path
        assert field.description, field.path


@pytest.mark.parametrize("name", ["", "two words", "a: b", "'", "../up", "x\ny: 1", "é", "#"])
def test_a_name_that_the_spec_refuses_is_refused(name):
    with pytest.raises(InputError) as caught:
        starter_text(name)
    assert caught.value.problems[0].field == "name"
    assert str(caught.value).startswith("gelslim new: name = ")


@pytest.mark.parametrize("name", ["true", "12", "1e3", "0x1", "null", "no", "A-1.b"])
def test_a_name_that_looks_like_another_value_stays_a_name(name):
    assert load(starter_text(name)).model.name == name


def test_the_text_is_reproducible():
    assert starter_text("a") == starter_text("a")
