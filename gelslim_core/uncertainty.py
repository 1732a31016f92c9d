"""Figures with their standard deviation as text, which is never rounded to zero.

A deviation printed as 0.000 looks like certainty, and more digits than two are not known.
"""

from __future__ import annotations

import math

MOST_DECIMALS = 6
"""Smaller deviations are written with an exponent."""


def two_digits(sigma: float) -> str:
    """A standard deviation with two significant digits; "unknown" where it is not finite."""
    if not math.isfinite(sigma):
        return "unknown"
    decimals = _decimals(sigma)
    if decimals > MOST_DECIMALS:
        return f"{sigma:.1e}"
    return f"{round(sigma, decimals):.{max(decimals, 0)}f}"


def with_sigma(value: float, sigma: float) -> str:
    """A value and its standard deviation, both to the second significant digit of the latter.

    Args:
        value: The value.
        sigma: Its standard deviation, at least 0. A value without one has three digits.

    Returns:
        Text such as "-1.010 ± 0.033", always with a sign; "unknown" for a value that is not finite.
    """
    if not math.isfinite(value):
        return "unknown"
    if not math.isfinite(sigma):
        return f"{value:+.3g}"
    decimals = min(_decimals(sigma), MOST_DECIMALS)
    return f"{round(value, decimals):+.{max(decimals, 0)}f} ± {two_digits(sigma)}"


def _decimals(sigma: float) -> int:
    """Decimal places of the second significant digit; negative for tens and more."""
    if sigma == 0.0:
        return 1
    return 1 - int(f"{sigma:.1e}".split("e")[1])
