"""Results as values that JSON holds, and records of such values read with checks."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import GelslimError

_KINDS = {"number": "iuf", "integer": "iu", "true or false": "b"}
"""NumPy's kinds of the types that a field may have."""


class RecordError(GelslimError, ValueError):
    """A record is not that of a result; the message names the field."""


def plain(value: Any) -> Any:
    """Return a value as JSON: arrays as lists, dataclasses as objects, other types as text.

    NaN and the infinities, which JSON does not have, become null, "inf" and "-inf".
    """
    if isinstance(value, np.ndarray | np.generic):
        whole = value.dtype.kind in "biu" or (value.dtype.kind == "f" and np.isfinite(value).all())
        return value.tolist() if whole else plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = [item.name for item in dataclasses.fields(value)]
        return {name: plain(getattr(value, name)) for name in names}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    return str(value)


@dataclass(frozen=True)
class RecordReader:
    """Reads the fields of a record that `plain` made; a field beyond those read is ignored.

    Attributes:
        record: The record.
        place: Where it stands, for messages, such as "wrench".

    Raises:
        RecordError: The record is no mapping, or on reading a field that is missing or wrong.
    """

    record: Mapping[str, Any]
    place: str

    def __post_init__(self) -> None:
        if not isinstance(self.record, Mapping):
            raise RecordError(f"{self.place}: {_shown(self.record)} is no object with named fields")

    def value(self, name: str) -> Any:
        """The field as it stands."""
        if name not in self.record:
            known = ", ".join(map(str, self.record)) or "none"
            raise RecordError(f"{self.place}.{name}: missing; the fields are {known}")
        return self.record[name]

    def real(self, name: str) -> float:
        """A number; null is NaN."""
        return float(self.reals(name))

    def known_real(self, name: str) -> float | None:
        """A number; null and a missing field are None."""
        return None if self.record.get(name) is None else self.real(name)

    def reals(self, name: str, *shape: int | None) -> NDArray[np.float64]:
        """Numbers of a shape, in which None is any length; null is NaN."""
        return self._array(name, np.dtype(np.float64), "number", shape)

    def known_reals(self, name: str, *shape: int | None) -> NDArray[np.float64] | None:
        """Numbers of a shape; None where the field is null."""
        return None if self.value(name) is None else self.reals(name, *shape)

    def integers(self, name: str, *shape: int | None) -> NDArray[np.int64]:
        """Integers of a shape, in which None is any length."""
        return self._array(name, np.dtype(np.int64), "integer", shape)

    def truths(self, name: str, *shape: int | None) -> NDArray[np.bool_]:
        """True or false of a shape, in which None is any length."""
        return self._array(name, np.dtype(np.bool_), "true or false", shape)

    def _array(
        self, name: str, kind: np.dtype[Any], what: str, shape: tuple[int | None, ...]
    ) -> NDArray[Any]:
        value = self.value(name)
        reals = what == "number"
        try:
            found = np.array(_numbers(value) if reals else value, dtype=None)
        except (ValueError, TypeError) as error:
            raise self.wrong(name, what, shape) from error
        if found.size == 0:
            empty = [0 if length is None else length for length in shape]
            found = np.zeros(empty if 0 in empty else found.shape, kind)
        fits = len(found.shape) == len(shape) and all(
            length in (None, given) for length, given in zip(shape, found.shape, strict=True)
        )
        if not fits or found.dtype.kind not in _KINDS[what]:
            raise self.wrong(name, what, shape)
        return found.astype(kind)

    def wrong(self, name: str, what: str, shape: tuple[int | None, ...] = ()) -> RecordError:
        """The error of a field that is no `what`, or has another shape."""
        lengths = " x ".join("n" if length is None else str(length) for length in shape)
        needed = f"a list of {lengths}: {what}" if shape else what
        return RecordError(f"{self.place}.{name} = {_shown(self.record[name])}: must be {needed}")


def _numbers(value: Any) -> Any:
    """Lists of numbers, with null as NaN and the infinities that `plain` writes as text."""
    if isinstance(value, list | tuple):
        return [_numbers(item) for item in value]
    if value is None:
        return math.nan
    return float(value) if value in ("inf", "-inf") else value


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
