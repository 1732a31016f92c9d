"""The stored sensitivities are complete, and their dimensions are those of the program."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from sampled import quick

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import sensitivities  # noqa: E402

QUICK = ("camera", "gel")


def stored() -> dict:
    return json.loads(sensitivities.DATA.read_text("utf-8"))


def test_every_field_listed_was_measured() -> None:
    listed = [text for texts in sensitivities.GROUPS.values() for text in texts]
    assert list(stored()) == listed
    for text, given in stored().items():
        count = len(given["values"])
        assert all(len(given[c]) == count for c in ("failed", *sensitivities.COLUMNS)), text


@pytest.mark.parametrize("group", quick(sensitivities.GROUPS, lambda name: name in QUICK))
def test_dimensions_and_verdicts_are_those_of_the_program(
    group: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Light and force error take minutes; `make docs` renews them."""
    monkeypatch.setattr(sensitivities, "GROUPS", {group: sensitivities.GROUPS[group]})
    assert sensitivities.differences(stored()) == []


def test_a_changed_dimension_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "housing.back_wall_mm=1,1.2,1.5"
    monkeypatch.setattr(sensitivities, "GROUPS", {"housing": (text,)})
    data = stored()
    data[text]["finger.thickness_mm"][0] += 0.05
    (found,) = sensitivities.differences(data)
    assert found.startswith(f"{text}: finger.thickness_mm")
