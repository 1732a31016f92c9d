"""Yields against closed forms, against plain Monte Carlo, and for hard cases."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binomtest, norm
from tolerance_samples import NONE, drawn, exact, spec

from gelslim_cad.dimensions import derive
from gelslim_cad.tolerance.causes import Cause, causes, errors
from gelslim_cad.tolerance.margins import RULES, margins
from gelslim_cad.tolerance.plan import with_values
from gelslim_cad.tolerance.study import study_record, tolerance_study
from gelslim_cad.tolerance.yields import (
    ALL,
    Sampled,
    Yield,
    broken,
    probabilities,
    sampled,
    yield_of,
)


@pytest.mark.parametrize("kind", ["uniform", "triangular", "normal"])
def test_causes_have_the_distributions_that_they_state(kind: str) -> None:
    cause = Cause("x_mm", "gel", "x", kind, 0.3)  # type: ignore[arg-type]
    values = cause.values(probabilities(1, 4096, 1)[:, 0])
    rough = drawn({"x": (kind, 0.3)}, 200_000, seed=2)["x"]
    assert values.mean() == pytest.approx(0, abs=1e-3)
    assert values.std() == pytest.approx(cause.deviation, rel=1e-2)
    assert values.std() == pytest.approx(rough.std(), rel=1e-2)
    for q in (0.1, 0.5, 0.9):
        assert np.quantile(values, q) == pytest.approx(np.quantile(rough, q), abs=5e-3)


def test_without_tolerances_every_finger_is_the_design() -> None:
    for stage in sampled(derive(exact("gelslim2")), 64, 0).values():
        assert {name: y.share for name, y in stage.yields().items()} == dict.fromkeys(
            stage.yields(), 1.0
        )


def test_without_tolerances_no_finger_of_a_broken_design_is_good() -> None:
    d = derive(exact("mini20", design__gel__length_mm=50.0))
    assert yield_of(d, 64, 0)[ALL].share == 0
    assert "marker.px" in broken(d)
    assert broken(derive(exact("mini20"))) == ()


def test_one_cause_gives_the_yield_of_its_closed_form() -> None:
    """The lens off the sensor's centre shifts the picture; both edges leave the same margin."""
    d = derive(exact("gelslim2", tolerance__lens_centring_mm=0.03))
    margin_mm = (1 - d["view.along_use"]) * d["view.sensor_along_mm"] / 2
    expected = 2 * norm.cdf(margin_mm / 0.03) - 1
    assert 0.4 < expected < 0.6
    found = yield_of(d, 4096, 3)["coverage.along"]
    assert found.share == pytest.approx(expected, abs=2e-3)


def test_a_uniform_cause_gives_the_yield_of_its_closed_form() -> None:
    """mini20 has 0.17 mm to its envelope; a body that is too high by more does not fit."""
    d = derive(exact("mini20", manufacturing__print_tolerance_mm=0.3))
    room = 18 - d["finger.thickness_mm"]
    assert 0.1 < room < 0.3
    found = yield_of(d, 4096, 3)["finger.thickness"]
    assert found.share == pytest.approx((room + 0.3) / 0.6, abs=2e-3)


@pytest.mark.parametrize("stage", ["as_built", "adjusted"])
def test_yields_are_those_of_plain_monte_carlo(stage: str) -> None:
    """Errors drawn by numpy from the stated distributions, without the inverse functions."""
    d = derive(spec("long50"))
    e = drawn({c.name: (c.distribution, c.spread) for c in causes(d)}, 20_000, seed=7)
    rough = Sampled(e, margins(d, e, stage)).yields()  # type: ignore[arg-type]
    fine = sampled(d, 8192, 1)[stage].yields()  # type: ignore[index]
    for name, found in fine.items():
        deviation = np.sqrt(found.share * (1 - found.share) * (1 / 8192 + 1 / 20_000))
        assert abs(found.share - rough[name].share) <= 4 * deviation + 1e-3, name


def test_the_seed_decides_and_the_interval_is_wilsons() -> None:
    d = derive(spec("wide"))
    first, again, other = (yield_of(d, 1000, seed)[ALL] for seed in (1, 1, 2))
    assert first == again
    assert abs(first.share - other.share) < 0.02
    z = norm.ppf(0.975)
    n, p = 1000, 0.9
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    assert Yield(900, 1000).interval == pytest.approx((middle - half, middle + half))
    assert binomtest(900, 1000).proportion_ci().low < Yield(900, 1000).interval[1]


HUGE = {
    **dict.fromkeys(NONE, 0.5),
    "design.housing.camera_play_mm": 2.0,
    "design.light_guide.thickness_mm": 2.5,
    "manufacturing.acrylic_tolerance_ratio": 0.5,
    "manufacturing.print_tolerance_mm": 1.0,
    "material.gel.poissons_ratio_tolerance": 0.2,
    "tolerance.acrylic": "as_bought",
    "tolerance.led_flux_percent": 50.0,
    "tolerance.focal_length_percent": 20.0,
    "tolerance.entrance_pupil_mm": 10.0,
    "tolerance.print_flatness_mm": 1.0,
}  # fmt: skip


@pytest.mark.parametrize(
    "focusing", [{}, {"camera.focusing": "fixed", "camera.focus_distance_mm": 38.0}]
)
def test_tolerances_of_half_a_size_give_finite_numbers(focusing: dict) -> None:
    """Half of every length, modulus and flux: the numbers are poor, and they are numbers."""
    d = derive(with_values(spec("gelslim2"), {**HUGE, **focusing}))
    found = sampled(d, 1024, 0)
    for stage in found.values():
        assert set(map(str, stage.yields())) >= set(RULES) - {"finger.thickness"}
        for margin in stage.places.values():
            assert np.isfinite(margin).all()
        assert stage.yields()[ALL].share < 0.05


@pytest.mark.slow
def test_the_record_of_absurd_tolerances_is_finite() -> None:
    record = study_record(
        tolerance_study(with_values(spec("gelslim2"), HUGE), samples=256, least_yield=1e-9)
    )
    numbers: list[float] = []

    def collect(value: object) -> None:
        if isinstance(value, dict):
            value = list(value.values())
        if isinstance(value, list):
            for item in value:
                collect(item)
        elif isinstance(value, float):
            numbers.append(value)

    collect(record)
    assert len(numbers) > 100
    assert np.isfinite(numbers).all()


def test_ten_thousand_probabilities_are_within_the_cube() -> None:
    d = derive(spec("gelslim2"))
    e = errors(causes(d), np.array([[0.0] * len(causes(d)), [1.0] * len(causes(d))]))
    assert all(np.isfinite(v).all() for v in e.values())
