"""Public names are loaded when they are used, once, and unknown ones are refused."""

from __future__ import annotations

import sys
import types

import pytest

from gelslim_core.lazy import lazy_exports


@pytest.fixture
def package(monkeypatch: pytest.MonkeyPatch) -> types.ModuleType:
    module = types.ModuleType("lazy_sample")
    get, names = lazy_exports("lazy_sample", {"sqrt": "math", "Fraction": "fractions"})
    module.__getattr__, module.__dir__ = get, names  # type: ignore[method-assign]
    monkeypatch.setitem(sys.modules, "lazy_sample", module)
    return module


def test_a_name_is_loaded_when_it_is_used_and_then_kept(package: types.ModuleType) -> None:
    assert "sqrt" not in vars(package)
    assert package.sqrt(9.0) == 3.0
    assert "sqrt" in vars(package)


def test_all_names_are_listed_before_they_are_loaded(package: types.ModuleType) -> None:
    assert {"Fraction", "sqrt"} <= set(dir(package))


def test_an_unknown_name_is_no_attribute(package: types.ModuleType) -> None:
    with pytest.raises(AttributeError):
        _ = package.cbrt
