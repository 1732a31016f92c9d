"""JSON of a build's files: the same content gives the same bytes."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

from gelslim_cad.checks import Check


def json_bytes(content: object) -> bytes:
    """Indented UTF-8 JSON with a final newline."""
    return (json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()


def checks_json(checks: tuple[Check, ...]) -> bytes:
    """checks.json."""
    return json_bytes([{k: plain(v) for k, v in asdict(c).items()} for c in checks])


def plain(value: Any) -> Any:
    """A value as JSON can hold it: numpy scalars and tuples unwrapped."""
    if isinstance(value, tuple):
        return [plain(v) for v in value]
    return value.item() if hasattr(value, "item") else value
