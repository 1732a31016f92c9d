"""A valid spec as text, and ways to spoil it."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import BaseModel

from gelslim_cad.spec.spec import Spec
from gelslim_core.yaml.errors import InputError, Problem
from gelslim_core.yaml.reader import Loaded, load_bytes

MINIMAL = """\
format: gelslim-spec/1
name: sample
camera:
  image_width_px: 640
  image_height_px: 480
  sensor_width_mm: 3.6
  sensor_height_mm: 2.7
  focal_length_mm: 3.0
  f_number: 2.9
design:
  gel:
    length_mm: 24
    width_mm: 22
"""
"""`design.gel.length_mm` is on line 12; a line added at the end is line 14."""

NAME = "designs/x.yaml"


def load(text: str | bytes, model: type[BaseModel] = Spec) -> Loaded[Any]:
    data = text if isinstance(text, bytes) else text.encode()
    return load_bytes(NAME, data, model)


def problems(text: str | bytes, model: type[BaseModel] = Spec) -> tuple[Problem, ...]:
    with pytest.raises(InputError) as caught:
        load(text, model)
    return caught.value.problems


def the_problem(text: str | bytes, model: type[BaseModel] = Spec) -> Problem:
    found = problems(text, model)
    assert len(found) == 1, [str(problem) for problem in found]
    return found[0]


def with_length(value: str) -> str:
    return MINIMAL.replace("    length_mm: 24", f"    length_mm: {value}")
