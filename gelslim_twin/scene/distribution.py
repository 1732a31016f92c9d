"""Ranges from which a value is drawn, with the name of their distribution.

Every draw is a function of a seed, a number and the name of what is drawn. So a value does not
depend on the order of the draws, nor on what else is drawn.
"""

from __future__ import annotations

import hashlib
import math
from statistics import NormalDist
from typing import Annotated, Any

from pydantic import Field

from gelslim_core.yaml.errors import FieldError
from gelslim_core.yaml.suggest import one_of

DISTRIBUTIONS = ("uniform", "log_uniform", "normal")
Distribution = Annotated[str, Field(json_schema_extra={"enum": list(DISTRIBUTIONS)})]
Range = Annotated[
    tuple[float, float] | tuple[float, float, Distribution],
    Field(description="Lowest and highest value, and the distribution: uniform without its name"),
]
NORMAL_RANGE_SIGMA = 2.0
"""A normal distribution has its mean midway and its range this many standard deviations wide to
either side; what lies beyond is not drawn."""


def require_ordered(name: str, given: Range) -> None:
    """Raise FieldError for a range whose ends are exchanged, or whose distribution is not known."""
    low, high = given[:2]
    if distribution_of(given) not in DISTRIBUTIONS:
        raise FieldError(
            name,
            f"{distribution_of(given)} is no distribution that is known",
            f"write {one_of(DISTRIBUTIONS)} third",
        )
    if low > high:
        raise FieldError(name, f"{low:g} is above {high:g}", "swap the two")
    if distribution_of(given) == "log_uniform" and low <= 0:
        raise FieldError(
            name, f"{low:g} has no logarithm", "raise the lower end, or write `uniform`"
        )


def distribution_of(given: Range) -> str:
    """Name of the distribution of a range."""
    return given[2] if len(given) == 3 else "uniform"


def value_at(given: Range, share: float) -> float:
    """The value below which a share (0 to 1) of the draws from a range lies."""
    low, high = given[:2]
    match distribution_of(given):
        case "log_uniform":
            return min(high, max(low, low * math.exp(share * math.log(high / low))))
        case "normal":
            unit, most = NormalDist(), NORMAL_RANGE_SIGMA
            tail = unit.cdf(-most)
            sigmas = unit.inv_cdf(tail + share * (1 - 2 * tail))
            return min(high, max(low, (low + high) / 2 + sigmas * (high - low) / (2 * most)))
        case _:
            return low + share * (high - low)


def farther_end(given: Range) -> float:
    """The end of a range that is farther from zero; the upper one of two that are as far."""
    low, high = given[:2]
    return low if abs(low) > abs(high) else high


def share_of(*what: Any) -> float:
    """An even number in [0, 1) from the hash of what it is for: the same on every machine."""
    return hashed(*what) / 2.0**53


def hashed(*what: Any) -> int:
    """A whole number below 2^53 from the hash of what it is for: the same on every machine."""
    digest = hashlib.sha256("/".join(map(str, what)).encode()).digest()
    return int.from_bytes(digest[:8], "big") >> 11
