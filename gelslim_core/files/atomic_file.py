"""A file that is there whole or not at all."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

from gelslim_core.files.replaced_file import replace_file as whole_file


def replace_file(path: str | os.PathLike[str], data: bytes) -> None:
    """Write `data` next to `path`, force it to the disk and move it into place.

    Raises OSError; the old file, if any, is then as it was.
    """
    whole_file(path, data)


def json_bytes(record: Mapping[str, Any]) -> bytes:
    """Return indented UTF-8 JSON with a final newline; NaN is not allowed in it."""
    text = json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False)
    # A lone surrogate, as of a file name in another code, becomes its JSON escape.
    return (text + "\n").encode("utf-8", "backslashreplace")
