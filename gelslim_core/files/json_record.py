"""JSON files that hold one record of a kind, such as a calibration."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from gelslim_core.files.replaced_file import json_bytes, replace_file

Value = TypeVar("Value")
Record = Mapping[str, Any]


@dataclass(frozen=True)
class RecordFile(Generic[Value]):
    """Writes and reads one kind of file.

    Attributes:
        form: What `format` is in its records.
        name: What such a file is, such as "light calibration".
        remedy: What to do where there is none.
        record: Makes the record of a value, with its `format`.
        value: Makes the value of a record; it may raise KeyError, ValueError, TypeError,
            IndexError, AttributeError or OverflowError for one of another kind.
        error: Makes the error of a message.
    """

    form: str
    name: str
    remedy: str
    record: Callable[[Value], Record]
    value: Callable[[Record], Value]
    error: Callable[[str], Exception]

    def write(self, value: Value, path: str | os.PathLike[str]) -> None:
        """Write a file as a whole: an earlier one is kept if writing fails.

        Args:
            value: What to write.
            path: File to write; its folder must exist.

        Raises:
            OSError: The file cannot be written.
        """
        replace_file(path, json_bytes(self.record(value)))

    def read(self, path: str | os.PathLike[str]) -> Value:
        """Read a file.

        Args:
            path: The file.

        Returns:
            What `value` makes.

        Raises:
            Exception: Of `error`, where the file cannot be opened, is damaged or of another kind.
        """
        place = Path(path)
        try:
            content = place.read_bytes()
        except OSError as error:
            raise self._refused(
                f"{place}: {(error.strerror or 'cannot be read').lower()}"
            ) from error
        try:
            return self._value(content)
        except (ValueError, TypeError, IndexError, AttributeError, OverflowError) as error:
            raise self._refused(f"{place} is no {self.name}: {error}") from error

    def _value(self, content: bytes) -> Value:
        try:
            record = json.loads(content.decode("utf-8"))
        except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
            raise ValueError(f"it is not JSON ({error})") from error
        if not isinstance(record, Mapping):
            raise ValueError("it does not hold a JSON object")
        if record.get("format") != self.form:
            raise ValueError(f"its format is {record.get('format')!r}, not {self.form}")
        try:
            return self.value(record)
        except KeyError as error:
            raise ValueError(f"{error.args[0]} is missing") from error

    def _refused(self, message: str) -> Exception:
        return self.error(f"{message}; {self.remedy}")
