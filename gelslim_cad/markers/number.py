"""Decimal numbers as text, the same on every machine."""

from __future__ import annotations


def decimal(value: float, places: int = 4) -> str:
    """Return `value` rounded to `places`, without trailing zeros, exponent or minus zero."""
    text = f"{float(value):.{places}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
