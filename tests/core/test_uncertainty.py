"""Values with their standard deviation: two digits of it, by decimal arithmetic."""

from __future__ import annotations

from decimal import Decimal

import numpy as np
import pytest

from gelslim_core.uncertainty import two_digits, with_sigma


@pytest.mark.parametrize(
    ("value", "sigma", "shown"),
    [
        (-1.0105, 0.0333, "-1.010 ± 0.033"),
        (-1.0105, 0.0003, "-1.01050 ± 0.00030"),
        (0.25, 0.0996, "+0.25 ± 0.10"),
        (0.25, 0.00996, "+0.250 ± 0.010"),
        (1234.5, 87.0, "+1234 ± 87"),
        (1234.5, 870.0, "+1230 ± 870"),
        (2.0, 3e-9, "+2.000000 ± 3.0e-09"),
        (0.25, 0.0, "+0.2 ± 0.0"),
        (0.25, float("nan"), "+0.25"),
        (float("nan"), 0.1, "unknown"),
    ],
)
def test_two_digits_of_the_deviation(value: float, sigma: float, shown: str) -> None:
    assert with_sigma(value, sigma) == shown


def test_no_deviation_is_rounded_to_nothing() -> None:
    """Random deviations over ten decades keep their size to 5 % of it."""
    rng = np.random.default_rng(6)
    for sigma in 10 ** rng.uniform(-7, 3, 400):
        text = two_digits(float(sigma))
        assert float(text) == pytest.approx(sigma, rel=0.05)
        assert len(Decimal(text).normalize().as_tuple().digits) <= 2
        value, shown = with_sigma(0.123456789, float(sigma)).split(" ± ")
        assert shown == text
        assert abs(float(value) - 0.123456789) <= max(0.051 * sigma, 6e-7)


def test_an_unknown_deviation_is_said() -> None:
    assert two_digits(float("inf")) == two_digits(float("nan")) == "unknown"
