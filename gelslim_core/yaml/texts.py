"""What someone meant who wrote text where a number or a yes-or-no belongs."""

from __future__ import annotations

import re

from gelslim_core.yaml.errors import shown
from gelslim_core.yaml.fields import Field
from gelslim_core.yaml.scalars import RefusedScalarError, resolve
from gelslim_core.yaml.units import UNITS, converted

_YES = frozenset(("yes", "y", "on", "true", "1"))
_NO = frozenset(("no", "n", "off", "false", "0"))
_QUANTITY = re.compile(r"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*([A-Za-zµμ°%]+)\Z")
_SYMBOLS = {"µm": "um", "μm": "um", "°": "deg", "%": "percent", "degree": "deg", "degrees": "deg"}


def text_remedy(text: str, field: Field, numeric: bool) -> str | None:
    """What to write instead of `text`, None where nobody can tell."""
    word = text.strip()[:80]
    if numeric:
        return _number_remedy(word, field)
    if bool in field.types and word.lower() in _YES | _NO:
        return f"write {'true' if word.lower() in _YES else 'false'}"
    return None


def _number_remedy(word: str, field: Field) -> str | None:
    if _number(word) is not None:
        return f"remove the quotes: {shown(word)}"
    grouped = word.replace("_", "").replace(" ", "").replace("'", "")
    if _number(grouped) is not None:
        return f"write {grouped}"
    if re.fullmatch(r"[-+]?[0-9]+,[0-9]{1,6}", word):
        return f"use a decimal point: {word.replace(',', '.')}"
    if found := _QUANTITY.match(word):
        return _quantity_remedy(found.group(1), found.group(2), field)
    if re.fullmatch(r"[-+]?(nan|inf|infinity)", word, re.IGNORECASE):
        return "give a finite number"
    if re.fullmatch(r"[0-9]+(:[0-9]+)+", word):
        return "write it as one number"
    return None


def _quantity_remedy(digits: str, symbol: str, field: Field) -> str | None:
    value = _number(digits)
    if value is None:
        return None
    name = _SYMBOLS.get(symbol.lower(), symbol.lower())
    target = field.unit
    if target is None or not target.label:
        return f"write {digits} without the unit"
    # M and m differ: "mPa" is no megapascal. Only symbols that are certain are converted.
    unit = UNITS.get(name)
    if unit == target:
        return f"write {digits}; the unit is in the name"
    number = converted(value, unit, target)
    if number is None:
        return f"write a plain number in {target.label}"
    return f"write {number:g}, in {target.label}"


def _number(text: str) -> float | None:
    try:
        value = resolve(text) if text else None
    except RefusedScalarError:
        return None
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number else None  # type: ignore[arg-type]
