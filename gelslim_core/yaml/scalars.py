"""Plain YAML scalars by the core schema of YAML 1.2 (section 10.3.2).

YAML 1.1 reads `no` as false, `010` as eight and `1:20` as eighty; version 1.2 reads text, ten
and text, and so does this module.
"""

from __future__ import annotations

import math
import re

MAX_INT = 2**53
"""Whole numbers beyond this lose digits as a double."""

ScalarValue = str | int | float | bool | None

_WORDS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_INTEGERS = {
    10: re.compile(r"([-+]?[0-9]+)\Z"),
    8: re.compile(r"0o([0-7]+)\Z"),
    16: re.compile(r"0x([0-9a-fA-F]+)\Z"),
}
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?\Z")
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)\Z|\.(nan|NaN|NAN)\Z")


class RefusedScalarError(ValueError):
    """A scalar that YAML allows and no field accepts; the text says what it must be."""


def resolve(text: str) -> ScalarValue:
    """The value of the plain (unquoted) scalar `text`.

    Raises `RefusedScalarError` for NaN, infinities and numbers beyond the range of a double or,
    for whole numbers, beyond `MAX_INT`.
    """
    if text in _WORDS:
        return _WORDS[text]
    for base, integer in _INTEGERS.items():
        if found := integer.match(text):
            return _bounded_int(found.group(1), base)
    if _NOT_FINITE.match(text):
        raise RefusedScalarError("must be a finite number")
    if not _FLOAT.match(text):
        return text
    value = float(text)
    if not math.isfinite(value):
        raise RefusedScalarError("must be a finite number, at most about 1.8e308")
    return value


def _bounded_int(digits: str, base: int) -> int:
    # Python refuses to convert very long digit strings, so their length is checked first.
    value = int(digits, base) if len(digits.lstrip("+-0")) < 40 and len(digits) < 400 else None
    if value is None or abs(value) > MAX_INT:
        raise RefusedScalarError("is too large a whole number, the limit is 2^53")
    return value
