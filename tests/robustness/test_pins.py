"""Every library that an extra asks for is pinned to a version that it allows, and once."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = {"": PROJECT["dependencies"], **PROJECT["optional-dependencies"]}
LINES = (ROOT / "requirements" / "constraints.txt").read_text(encoding="utf-8").splitlines()
PINS = [line.partition("==")[::2] for line in LINES if line and not line.startswith("#")]


@pytest.mark.parametrize("extra", EXTRAS)
def test_an_extra_is_pinned(extra: str) -> None:
    pins = {canonicalize_name(name): version for name, version in PINS}
    for wanted in map(Requirement, EXTRAS[extra]):
        if wanted.name != PROJECT["name"]:
            assert wanted.specifier.contains(pins[canonicalize_name(wanted.name)]), wanted


def test_no_library_is_pinned_twice() -> None:
    names = [canonicalize_name(name) for name, _ in PINS]
    assert len(names) == len(set(names)) > 100
    assert all(version for _, version in PINS)
    assert LINES[0].startswith("# ")
