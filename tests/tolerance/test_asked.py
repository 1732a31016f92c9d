"""A spec that asks for a yield in place of an image margin."""

from __future__ import annotations

from pathlib import Path

import pytest

import gelslim
from gelslim_cad.dimensions import derive
from gelslim_cad.tolerance.asked import SAMPLES, SEED, read_spec
from gelslim_cad.tolerance.plan import MARGIN_PATH, with_values
from gelslim_cad.tolerance.yields import ALL, yield_of
from gelslim_core.yaml.errors import InputError

SPEC = """
format: gelslim-spec/1
name: asked
camera: {image_width_px: 640, image_height_px: 480, sensor_width_mm: 3.6288,
         sensor_height_mm: 2.7216, focal_length_mm: 3.6, f_number: 2.9}
design:
  gel: {length_mm: 22, width_mm: 20}
  envelope: {least_yield: 0.9}
tolerance: {adjusted: true, acrylic: measured}
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "asked.yaml"
    path.write_text(text, "utf-8")
    return path


@pytest.mark.slow
def test_the_margin_is_the_least_that_gives_the_yield(tmp_path: Path) -> None:
    spec = read_spec(written(tmp_path, SPEC)).spec
    margin = spec.design.optics.image_margin
    assert yield_of(derive(spec), SAMPLES, SEED)[ALL].share >= 0.9
    less = with_values(spec, {MARGIN_PATH: margin - 0.003})
    assert yield_of(derive(less), SAMPLES, SEED)[ALL].share < 0.9
    assert gelslim.derive(tmp_path / "asked.yaml")["view.along_use"] <= 1 - margin + 1e-6


def test_without_the_question_the_margin_is_the_given_one(tmp_path: Path) -> None:
    text = SPEC.replace("envelope: {least_yield: 0.9}", "optics: {image_margin: 0.07}")
    loaded = read_spec(written(tmp_path, text))
    assert loaded.spec.design.optics.image_margin == 0.07
    assert MARGIN_PATH not in loaded.lent


def test_a_yield_that_no_margin_gives_is_refused_at_its_line(tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        read_spec(written(tmp_path, SPEC.replace("0.9}", "0.9999}")))
    (problem,) = refused.value.problems
    assert (problem.line, problem.field) == (8, "design.envelope.least_yield")
