"""What to change: the yields of a plan, the least image margin, the price of a per cent."""

from __future__ import annotations

import pytest
from tolerance_samples import NAMES, exact, spec

from gelslim_cad.dimensions import derive
from gelslim_cad.tolerance.plan import (
    COVERAGE,
    MARGIN_FOUND,
    MARGIN_PATH,
    least_margin,
    plan,
    thickness_per_percent,
    with_values,
)
from gelslim_cad.tolerance.yields import ALL, yield_of


@pytest.mark.slow
def test_a_plan_leads_to_the_yield_also_with_other_samples() -> None:
    start = spec("long50")
    found = plan(start, 0.95, 512, 0)
    assert found.reached
    assert [s.share for s in found.steps] == sorted(s.share for s in found.steps)
    after = derive(with_values(start, found.changes()))
    assert found.steps[-1].thickness_mm == after["finger.thickness_mm"]
    assert yield_of(after, 4096, 9)[ALL].share > 0.93


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_design_reaches_95_per_cent_by_usual_changes(name: str) -> None:
    start = spec(name)
    found = plan(start, 0.95, 2048, 0)
    assert found.reached
    after = derive(with_values(start, found.changes()))
    assert after.feasible()
    assert yield_of(after, 8192, 9)[ALL].share > 0.94
    assert after["finger.thickness_mm"] - found.steps[0].thickness_mm < 0.5


@pytest.mark.slow
def test_the_least_margin_is_enough_and_less_is_not() -> None:
    start = exact("gelslim2", tolerance__lens_centring_mm=0.03)
    margin = least_margin(start, 0.95, 1024, 0, rules=COVERAGE)
    assert margin is not None

    def share(value: float) -> float:
        found = yield_of(derive(with_values(start, {MARGIN_PATH: value})), 1024, 0)
        return min(found[rule].share for rule in COVERAGE)

    # The picture may shift by 1.96 standard deviations, of half a picture of 1.36 mm.
    assert margin == pytest.approx(1.96 * 0.03 / 1.3608, abs=3e-3)
    assert share(margin) >= 0.95
    assert share(margin - 3 * MARGIN_FOUND) < 0.95


def test_a_yield_that_no_margin_gives_is_told_so() -> None:
    start = exact("gelslim2", tolerance__mirror_thickness_mm=1.0)
    assert least_margin(start, 0.999, 64, 0) is None


def test_the_price_of_a_per_cent_is_that_of_two_designs() -> None:
    start = exact("gelslim2", tolerance__lens_centring_mm=0.03)
    more = derive(with_values(start, {MARGIN_PATH: 0.02}))
    d = derive(start)
    gain = yield_of(more, 1024, 0)[ALL].share - yield_of(d, 1024, 0)[ALL].share
    thicker = more["finger.thickness_mm"] - d["finger.thickness_mm"]
    assert thickness_per_percent(start, d, 1024, 0) == pytest.approx(thicker / gain / 100)
    assert gain > 0.05


def test_values_that_the_spec_refuses_are_refused() -> None:
    with pytest.raises(ValueError, match="image_margin"):
        with_values(spec("gelslim2"), {MARGIN_PATH: 0.9})
