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

_NULL = frozenset(("", "~", "null", "Null", "NULL"))
_TRUE = frozenset(("true", "True", "TRUE"))
_FALSE = frozenset(("false", "False", "FALSE"))
_INT = re.compile(r"[-+]?[0-9]+\Z")
_OCTAL = re.compile(r"0o[0-7]+\Z")
_HEX = re.compile(r"0x[0-9a-fA-F]+\Z")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?\Z")
_INF = re.compile(r"[-+]?\.(inf|Inf|INF)\Z")
_NAN = frozenset((".nan", ".NaN", ".NAN"))
_NUMBER_START = frozenset("+-.0123456789")


class RefusedScalarError(ValueError):
    """A scalar that YAML allows and no field accepts; the text says what it must be."""


def resolve(text: str) -> ScalarValue:
    """The value of the plain (unquoted) scalar `text`.

    Raises `RefusedScalarError` for NaN, infinities and numbers beyond the range of a double or,
    for whole numbers, beyond `MAX_INT`.
    """
    if text in _NULL:
        return None
    if text in _TRUE:
        return True
    if text in _FALSE:
        return False
    if text[0] not in _NUMBER_START:
        return text
    return _resolve_number(text)


def _resolve_number(text: str) -> str | int | float:
    if _INT.match(text):
        return _bounded_int(text, 10)
    if _OCTAL.match(text):
        return _bounded_int(text[2:], 8)
    if _HEX.match(text):
        return _bounded_int(text[2:], 16)
    if _INF.match(text) or text in _NAN:
        raise RefusedScalarError("must be a finite number")
    if _FLOAT.match(text):
        value = float(text)
        if not math.isfinite(value):
            raise RefusedScalarError("must be a finite number, at most about 1.8e308")
        return value
    return text


def _bounded_int(digits: str, base: int) -> int:
    # Python refuses to convert very long digit strings, so their length is looked at first.
    value = int(digits, base) if len(digits.lstrip("+-0")) < 40 and len(digits) < 400 else None
    if value is None or abs(value) > MAX_INT:
        raise RefusedScalarError("is too large a whole number, the limit is 2^53")
    return value
