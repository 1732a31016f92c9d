"""Public names are loaded when they are used, once, and unknown ones are refused."""

from __future__ import annotations

import importlib
import sys
import types
from pathlib import Path

import pytest

SAMPLE = """
from typing import TYPE_CHECKING

from gelslim_core.lazy import lazy_exports

if TYPE_CHECKING:
    from fractions import Fraction
    from math import cos, sqrt

__getattr__, __dir__ = lazy_exports(__name__)
"""


@pytest.fixture
def package(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> types.ModuleType:
    (tmp_path / f"lazy_{tmp_path.name}.py").write_text(SAMPLE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    module = importlib.import_module(f"lazy_{tmp_path.name}")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    return module


def test_a_name_is_loaded_when_it_is_used_and_then_kept(package: types.ModuleType) -> None:
    assert "sqrt" not in vars(package)
    assert package.sqrt(9.0) == 3.0
    assert "sqrt" in vars(package)


def test_all_names_are_listed_before_they_are_loaded(package: types.ModuleType) -> None:
    assert {"Fraction", "cos", "sqrt"} <= set(dir(package))


@pytest.mark.parametrize("name", ["cbrt", "math"])
def test_an_unknown_name_is_no_attribute(package: types.ModuleType, name: str) -> None:
    with pytest.raises(AttributeError):
        getattr(package, name)
