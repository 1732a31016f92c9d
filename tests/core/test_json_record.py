"""Records from JSON files: what is read, and the reason where nothing is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from gelslim_core.files.json_record import read_json_record


class RefusedError(Exception):
    """A reason, and whether the file could be opened."""


def root(record: Mapping[str, Any]) -> float:
    return float(record["numbers"][1]) ** 0.5


def found(place: Path) -> float:
    return read_json_record(place, root, RefusedError)


def test_the_result_is_made_of_the_record(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text('{"numbers": [1, 9]}', encoding="utf-8")
    assert found(tmp_path / "a.json") == 3.0


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"{", "JSON"),
        (b"\xff", "JSON"),
        (b"[" * 100_000, "JSON"),
        (b"[1]", "object"),
        (b"{}", "numbers is missing"),
        (b'{"numbers": [1]}', "range"),
        (b'{"numbers": [1, "x"]}', "x"),
        (b'{"numbers": null}', "None"),
    ],
)
def test_what_holds_no_record_is_refused_with_the_reason(
    tmp_path: Path, content: bytes, reason: str
) -> None:
    (tmp_path / "a.json").write_bytes(content)
    with pytest.raises(RefusedError, match=reason) as refused:
        found(tmp_path / "a.json")
    assert refused.value.args[1] is True


def test_what_cannot_be_opened_is_told_apart(tmp_path: Path) -> None:
    for place in (tmp_path / "missing.json", tmp_path):
        with pytest.raises(RefusedError) as refused:
            found(place)
        assert refused.value.args[1] is False
