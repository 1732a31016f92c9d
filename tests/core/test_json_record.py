"""Files with one record: what is written is read, and what is no such file is refused."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from gelslim_core.files.json_record import RecordFile


class RefusedError(Exception):
    """Of a file."""


def root(record: Mapping[str, Any]) -> float:
    return float(record["numbers"][1]) ** 0.5


def squares(value: float) -> dict[str, Any]:
    return {"format": "roots/1", "numbers": [1.0, value**2]}


FILE = RecordFile("roots/1", "root", "draw it", squares, root, RefusedError)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    FILE.write(3.0, tmp_path / "a.json")
    assert FILE.read(tmp_path / "a.json") == 3.0
    with pytest.raises(ValueError, match="JSON"):
        FILE.write(float("nan"), tmp_path / "a.json")
    assert FILE.read(str(tmp_path / "a.json")) == 3.0


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"{", "JSON"),
        (b"\xff", "JSON"),
        (b"[" * 100_000, "JSON"),
        (b"[1]", "object"),
        (b"{}", "None, not roots/1"),
        (b'{"format": "roots/2", "numbers": [1, 9]}', "roots/2"),
        (b'{"format": "roots/1"}', "numbers is missing"),
        (b'{"format": "roots/1", "numbers": [1]}', "range"),
        (b'{"format": "roots/1", "numbers": [1, "x"]}', "x"),
        (b'{"format": "roots/1", "numbers": null}', "None"),
    ],
)
def test_what_holds_no_record_is_refused_with_the_reason(
    tmp_path: Path, content: bytes, reason: str
) -> None:
    (tmp_path / "a.json").write_bytes(content)
    with pytest.raises(RefusedError, match=reason) as refused:
        FILE.read(tmp_path / "a.json")
    assert "is no root" in str(refused.value)
    assert str(refused.value).endswith("; draw it")


def test_what_cannot_be_opened_is_told_apart(tmp_path: Path) -> None:
    for place in (tmp_path / "missing.json", tmp_path):
        with pytest.raises(RefusedError) as refused:
            FILE.read(place)
        assert "is no root" not in str(refused.value)
        assert str(place) in str(refused.value)
