"""The panels of the layout for Foxglove by the types that its makers publish for Python."""

from __future__ import annotations

import dataclasses
import json
import types
import typing
from pathlib import Path
from typing import Any

import pytest

layouts: Any = pytest.importorskip(
    "foxglove.layouts", reason="NOT TESTED: the types of panels need foxglove-sdk"
)

LAYOUT = Path(__file__).parents[2] / "integrations" / "foxglove" / "gelslim.json"
PANELS = json.loads(LAYOUT.read_text(encoding="utf-8"))["configById"]
CONFIGS = {
    "3D": layouts.ThreeDeeConfig,
    "Plot": layouts.PlotConfig,
    "StateTransitions": layouts.StateTransitionsConfig,
}
IN_FILES = {"foxglovePanelTitle", "imageMode"}
"""Keys that stand in exported files alone: the title of a panel, and what 3D and image share."""


@pytest.mark.parametrize("name", PANELS)
def test_every_setting_is_one_of_its_panel(name: str) -> None:
    config = {key: value for key, value in PANELS[name].items() if key not in IN_FILES}
    assert faults(config, CONFIGS[name.partition("!")[0]], name) == []


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("xAxisVal", "time"),
        ("showLegends", True),
        ("isSynced", "yes"),
        ("paths", [{"value": "/a.b", "timestampMethod": "arrival"}]),
        ("paths", [{"value": 3.0}]),
        ("sidebarDimension", None),
    ],
)
def test_wrong_settings_are_found(key: str, value: Any) -> None:
    """Of a judge that finds nothing nobody would learn; a missing value is none of these."""
    expected = 0 if value is None else 1
    assert len(faults({"xAxisVal": "timestamp", key: value}, layouts.PlotConfig, "")) == expected


def faults(value: Any, kind: Any, place: str) -> list[str]:
    """Where a JSON value is not of a type: unknown keys and values."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        return min((faults(value, one, place) for one in arguments), key=len)
    if origin is typing.Literal:
        return [] if value in arguments else [f"{place}: {value!r} is none of {arguments}"]
    if dataclasses.is_dataclass(kind) and isinstance(value, dict):
        known = keys(kind)
        unknown = [
            f"{place}.{key} is no setting of {kind.__name__}" for key in value.keys() - known
        ]
        return unknown + [
            fault
            for key in value.keys() & known.keys()
            for fault in faults(value[key], known[key], f"{place}.{key}")
        ]
    if origin is dict and isinstance(value, dict):
        return [
            f for key, one in value.items() for f in faults(one, arguments[1], f"{place}.{key}")
        ]
    if origin in (list, tuple) and isinstance(value, list):
        each = arguments if origin is tuple else arguments * len(value)
        if len(each) != len(value):
            return [f"{place} has {len(value)} items, not {len(each)}"]
        pairs = enumerate(zip(value, each, strict=True))
        return [f for k, (one, part) in pairs for f in faults(one, part, f"{place}[{k}]")]
    plain = (int, float) if kind is float else kind
    is_flag = isinstance(value, bool) and kind is not bool
    if isinstance(plain, type | tuple) and isinstance(value, plain) and not is_flag:
        return []
    return [f"{place}: {value!r} is no {kind}"]


def keys(kind: Any) -> dict[str, Any]:
    """The JSON keys of a class of settings, and the type of each: as it writes itself."""
    hints = typing.get_type_hints(kind)
    written = json.loads(kind(**{f.name: f.name for f in dataclasses.fields(kind)}).to_json())
    return {key: hints[name] for key, name in written.items()}
