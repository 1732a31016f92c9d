"""Small pieces of HTML: escaping, numbers, addresses."""

from __future__ import annotations

import html
import math
import re
from urllib.parse import quote

Scalar = float | int | str | bool | None
"""A value as shown: number, text, yes/no, or nothing."""


def text(value: object) -> str:
    """Escape for element content and for quoted attributes; drop what XML cannot hold."""
    return html.escape(re.sub(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]", "\ufffd", str(value)))


def number(value: Scalar, digits: int = 5) -> str:
    """Write a value with `digits` significant digits and a true minus sign; not escaped."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return str(value).replace("-", "\u2212")
    if isinstance(value, str):
        return value
    if not math.isfinite(value):
        return "–" if math.isnan(value) else ("∞" if value > 0 else "\u2212∞")
    written = f"{value:.{digits}g}"
    if "e" in written:
        mantissa, exponent = written.split("e")
        return f"{mantissa}e{int(exponent)}".replace("-", "\u2212")
    return ("0" if float(written) == 0 else written).replace("-", "\u2212")


def with_unit(value: Scalar, unit: str, digits: int = 5) -> str:
    """Write `value unit` as escaped HTML with the unit set apart."""
    shown = text(number(value, digits))
    if not unit or unit in {"-", "1"} or value is None:
        return shown
    return f'{shown}<span class="unit">\u2009{text(unit)}</span>'


def href(path: str) -> str:
    """Percent-encode a relative path; `./` keeps a colon from being read as a scheme."""
    return text("./" + quote(path))


def anchor(prefix: str, name: str) -> str:
    """Make an element id from a name: same name, same id."""
    return f"{prefix}-" + re.sub(r"[^A-Za-z0-9_.-]", "_", name)


def size(count: int) -> str:
    """Write a number of bytes with a decimal prefix."""
    if count < 1000:
        return f"{count} B"
    for unit, scale in (("kB", 1e3), ("MB", 1e6)):
        if count < 999.5 * scale:
            return f"{count / scale:.3g} {unit}"
    return f"{count / 1e9:.3g} GB"


def coordinate(value: float) -> str:
    """Write a drawing coordinate: at most two decimals, no trailing zeros."""
    written = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if written in {"-0", ""} else written
