"""Plain scalars against the table of YAML 1.2, section 10.3.2."""

import math

import pytest

from gelslim_core.yaml.document import MAX_INT, RefusedScalarError, resolve


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *((text, None) for text in ("", "~", "null", "Null", "NULL")),
        *((text, True) for text in ("true", "True", "TRUE")),
        *((text, False) for text in ("false", "False", "FALSE")),
        ("0", 0),
        ("-19", -19),
        ("+12", 12),
        ("010", 10),
        ("0o7", 7),
        ("0x3A", 58),
        (str(MAX_INT), MAX_INT),
        ("-0.0", -0.0),
        (".5", 0.5),
        ("12.", 12.0),
        ("+12e03", 12000.0),
        ("-2E+05", -200000.0),
        ("1e-999", 0.0),
    ],
)
def test_core_schema(text, value):
    found = resolve(text)
    assert type(found) is type(value)
    assert found == value
    if isinstance(value, float):
        assert math.copysign(1, value) == math.copysign(1, found)


@pytest.mark.parametrize(
    "text",
    [
        *("y", "Y", "yes", "no", "on", "off", "tRue", "nUll", "1:20", "190:20:30", "1_000"),
        *("0b1010", "0o8", "0xg", "-0x1", "1.2.3", "e3", "1e", "+", "-", ".", "..5", "+.", "1 2"),
        *("2001-12-14", "=", "<<", "inf", "nan", "-.nan", "１２", "0x", "0o", "1e3.5"),
    ],
)
def test_everything_else_is_text(text):
    assert resolve(text) == text


@pytest.mark.parametrize(
    "text",
    [
        *(".nan", ".NaN", ".NAN", ".inf", "-.inf", "+.INF", "1e309", "-1e309"),
        *(str(MAX_INT + 1), "-" + "9" * 5000, "0x" + "f" * 5000, "0o" + "7" * 30, "1" * 399),
    ],
)
def test_values_out_of_range_are_refused(text):
    with pytest.raises(RefusedScalarError):
        resolve(text)
