"""A record from a JSON file, or the reason why there is none."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

Kind = TypeVar("Kind")


def read_json_record(
    place: Path,
    read: Callable[[Mapping[str, Any]], Kind],
    refused: Callable[[str, bool], Exception],
) -> Kind:
    """Read a JSON file that holds one object.

    Args:
        place: The file.
        read: Makes the result of the object; it may raise KeyError, ValueError, TypeError,
            IndexError, AttributeError or OverflowError for an object of another kind.
        refused: Makes the error of a reason, and of whether the file could be opened.

    Returns:
        What `read` makes.

    Raises:
        Exception: Of `refused`, where the file cannot be opened or holds something else.
    """
    try:
        content = place.read_bytes()
    except OSError as error:
        raise refused((error.strerror or "cannot be read").lower(), False) from error
    try:
        record = json.loads(content.decode("utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise refused(f"it is not JSON ({error})", True) from error
    if not isinstance(record, Mapping):
        raise refused("it does not hold a JSON object", True)
    try:
        return read(record)
    except KeyError as error:
        raise refused(f"{error.args[0]} is missing", True) from error
    except (ValueError, TypeError, IndexError, AttributeError, OverflowError) as error:
        raise refused(str(error), True) from error


def refusal(place: Path, kind: str, remedy: str, reason: str, opened: bool) -> str:
    """Words for a file that holds no record of a kind.

    Args:
        place: The file.
        kind: What it should hold, such as "light calibration".
        remedy: What to do.
        reason: Why it is refused.
        opened: Whether it could be opened.
    """
    what = f"{place} is no {kind}" if opened else f"{place}"
    return f"{what}: {reason}; {remedy}"
