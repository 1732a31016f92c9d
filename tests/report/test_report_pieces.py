"""The small functions of the report against what they must do by definition."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gelslim_cad.checks import Check
from gelslim_cad.report.camera_view import LEVELS, colour, levels
from gelslim_cad.report.markup import coordinate, href, number, size, text
from gelslim_cad.report.rules import LIMIT_AT, WIDTH, bar_positions, rules, verdict
from gelslim_cad.report.tables import substituted

REAL = st.floats(-1e6, 1e6, allow_nan=False)


def rule(value, limit, margin, status="pass", sense=""):
    return Check("a.b", "t", value, limit, "mm", margin, status, "r", "p", sense=sense)


def test_a_limit_is_the_largest_value_unless_the_rule_says_least():
    assert "≤ 2<" in rules((rule(1.0, 2.0, 1.0),)).replace('<span class="unit">', "<")
    assert "≥ 2<" in rules((rule(3.0, 2.0, 1.0, sense="min"),)).replace('<span class="unit">', "<")
    assert "svg" not in rules((rule(math.nan, 1.0, 0.1),))
    assert "svg" not in rules((rule(1.0, None, None),))


@given(REAL, REAL)
def test_bar_keeps_order_and_stays_inside(value, limit):
    zero, at_value, at_limit = bar_positions(value, limit)
    assert all(0 <= place <= WIDTH for place in (zero, at_value, at_limit))
    if value < limit:
        assert at_value <= at_limit
    if value > limit:
        assert at_value >= at_limit
    if value == limit:
        assert at_value == pytest.approx(at_limit)
        assert limit <= 0 or at_limit == pytest.approx(LIMIT_AT * WIDTH)


def test_substitution_takes_whole_names_only():
    inputs = {"f_mm": 3.6, "mirror.f_mm_far": -2.0, "n": 4, "kind": "flat"}
    assert substituted("f_mm*f_mm_far + xf_mm + n(n)", inputs) == "3.6*\u22122 + xf_mm + n(4)"
    assert substituted("kind + 1", inputs) == "kind + 1"
    assert substituted("a.f_mm", inputs) == "a.f_mm"
    both = {"gel.h_mm": 1.0, "guide.h_mm": 2.0}
    assert substituted("gel.h_mm + guide.h_mm + h_mm", both) == "1 + 2 + h_mm"


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (17.400000001, "17.4"), (-0.5, "\u22120.5"), (-0.0, "0"), (1234567.0, "1.2346e6"),
        (2e-9, "2e\u22129"), (True, "yes"), (None, "–"), (math.inf, "∞"), (math.nan, "–"),
        (1764, "1764"), (-3, "\u22123"), ("flat", "flat"),
    ],
)  # fmt: skip
def test_numbers_are_written_plainly(value, shown):
    assert number(value) == shown


@given(REAL)
def test_coordinates_round_trip(value):
    assert float(coordinate(value)) == pytest.approx(value, abs=0.00501)
    assert "e" not in coordinate(value)


def test_sizes_and_links():
    assert [size(n) for n in (0, 999, 1000, 999_499, 999_500, 12_345_678)] == [
        "0 B", "999 B", "1 kB", "999 kB", "1 MB", "12.3 MB",
    ]  # fmt: skip
    assert href("step/a b#1.step") == "./step/a%20b%231.step"
    assert text("a\x00b<\ud83d\ude00>"[:3]) == "a\ufffdb"


def test_levels_cover_the_range_and_keep_order():
    values = [0.0, 0.1, 0.5, 0.99, 1.0]
    found = levels(values)
    assert (found[0], found[-1]) == (0, LEVELS - 1)
    assert found == sorted(found)
    assert set(levels([2.0, 2.0])) == {LEVELS // 2}


def test_ramp_grows_lighter_so_that_it_also_reads_in_grey():
    def luminance(shade):
        red, green, blue = (int(shade[i : i + 2], 16) / 255 for i in (1, 3, 5))
        return 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2

    light = [luminance(colour(level)) for level in range(LEVELS)]
    assert all(low < high for low, high in itertools.pairwise(light))


def test_verdict_counts():
    def data(*statuses):
        return tuple(rule(1.0, 2.0, 1.0, status) for status in statuses)

    assert verdict(data("pass", "fail", "warn")) == ("fail", "1 of 3 rules fail")
    assert verdict(data("pass", "warn")) == ("warn", "passes, 1 warning")
    assert verdict(data("pass", "pass")) == ("pass", "passes all 2 rules")


def test_a_margin_below_what_value_and_limit_show_is_none():
    row = rule(0.16666634, 0.16666667, 3.24e-7, sense="max")
    assert "margin 0<" in rules((row,)).replace('<span class="unit">\u2009mm</span>', "")
    real = rule(0.1666, 0.16666667, 6.7e-5, sense="max")
    assert "margin 6.7e\u22125" in rules((real,))


def test_every_sentence_of_a_reason_starts_large():
    reason = "stop it by f²/(s - f). take more"
    row = Check("a", "t", 1, 2, "mm", 1, "pass", reason, "p", sense="max")
    assert "<p>Stop it by f²/(s - f). Take more</p>" in rules((row,))
