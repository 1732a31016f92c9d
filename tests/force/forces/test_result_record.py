"""Results cannot be changed, and come back from JSON to the last bit."""

from __future__ import annotations

import copy
import json
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import output_samples as samples
import pytest

from gelslim_force.forces.frame_result import ForceField, FrameResult
from gelslim_force.forces.record import RecordError
from gelslim_force.forces.wrench import Wrench

STAMP_S = 1_795_441_687.125
WHOLE = samples.frame(3, problems=("dim", "größe 3×5 \udcff"), stamp_s=STAMP_S)
RESULTS = [
    WHOLE,
    samples.frame(2, normal_known=False),
    samples.unreadable(4),
    FrameResult(np.int64(1), float("nan"), stage_ms={"track": float("inf")}),  # type: ignore[arg-type]
]


def sent(result: Any) -> dict[str, Any]:
    """The record as another program gets it, by JSON that knows no NaN."""
    found: dict[str, Any] = json.loads(json.dumps(result.to_record(), allow_nan=False))
    return found


@pytest.mark.parametrize("given", RESULTS)
def test_a_result_comes_back_from_json(given: FrameResult) -> None:
    found = FrameResult.from_record(sent(given))
    if np.isfinite(given.time_s):
        samples.assert_same(found, given, 0.0)
    else:
        assert np.isnan(found.time_s)
        assert (found.index, found.stage_ms["track"]) == (1, np.inf)
    assert sent(found) == sent(given)


def test_a_low_pass_and_findings_come_back() -> None:
    assert WHOLE.field is not None
    field = replace(WHOLE.field, low_pass_mm=np.array([0.3, np.nan]))
    found = FrameResult.from_record(sent(replace(WHOLE, field=field)))
    assert found.field is not None
    np.testing.assert_array_equal(found.field.low_pass_mm, [0.3, np.nan])
    assert found.extra == {"patch": {"radius_mm": 3.3, "centre_mm": [1.5, -0.8]}}


def test_a_field_without_nodes_and_tracks_without_markers_come_back() -> None:
    none = np.zeros((0, 3))
    field = ForceField(none, none, none, none, np.zeros(0, np.bool_), np.full(2, np.nan), np.nan)
    found = ForceField.from_record(sent(field))
    assert (found.force_n.shape, found.contact.shape) == ((0, 3), (0,))
    assert found.contact.dtype == np.bool_


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (("format",), "gelslim-frame-result/9", "format"),
        (("index",), 1.5, "index"),
        (("time_s",), "noon", "time_s"),
        (("wrench", "covariance"), [[1.0] * 6] * 5, "6 x 6"),
        (("wrench", "force_n"), [1.0, 2.0], "force_n"),
        (("wrench", "torque_nmm"), [1.0, [2.0], 3.0], "torque_nmm"),
        (("field", "traction_mpa"), [[0.0, 0.0, 0.0]], "traction_mpa"),
        (("field", "contact"), [0.5] * len(samples.NODES_MM), "contact"),
        (("tracks", "dots"), None, "dots"),
        (("problems",), "dim", "problems"),
        (("wrench",), 3, "wrench"),
        (("stage_ms",), {"track": "fast"}, "track"),
    ],
)
def test_a_wrong_field_is_named(place: tuple[str, ...], value: Any, words: str) -> None:
    record = sent(WHOLE)
    inner = record
    for name in place[:-1]:
        inner = inner[name]
    inner[place[-1]] = value
    with pytest.raises(RecordError, match=words):
        FrameResult.from_record(record)
    del inner[place[-1]]
    if place[0] != "stage_ms":
        with pytest.raises(RecordError, match="missing"):
            FrameResult.from_record(record)


@pytest.mark.parametrize(
    "made",
    [
        lambda result: result,
        copy.copy,
        copy.deepcopy,
        lambda result: pickle.loads(pickle.dumps(result)),
        lambda result: FrameResult.from_record(sent(result)),
    ],
)
def test_nothing_in_a_result_can_be_changed(made: Any) -> None:
    result = made(WHOLE)
    samples.assert_same(result, WHOLE, 0.0)
    arrays = [
        value
        for part in (result, result.field, result.wrench, result.tracks)
        for value in vars(part).values()
        if isinstance(value, np.ndarray)
    ]
    assert len(arrays) == 1 + 6 + 3 + 4
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(AttributeError):
        result.wrench.force_n = np.zeros(3)
    for mapping in (result.extra, result.stage_ms):
        with pytest.raises(TypeError):
            mapping["more"] = 1.0


def test_a_result_does_not_follow_the_arrays_it_was_made_of() -> None:
    force, stages = np.array([0.1, 0.2, -1.0]), {"track": 1.0}
    view = force.view()
    view.flags.writeable = False
    wrenches = [Wrench(given, np.zeros(3), np.eye(6)) for given in (force, view)]
    result = FrameResult(0, 0.0, wrench=wrenches[0], stage_ms=stages)
    force[:], stages["track"] = 9.0, 9.0
    for wrench in wrenches:
        assert wrench.force_n.tolist() == [0.1, 0.2, -1.0]
    assert result.stage_ms["track"] == 1.0
    assert replace(result, index=1).wrench is result.wrench
