"""Shares of built fingers that keep the rules, from seeded samples, with their uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest, qmc

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.tolerance.assembly import STAGES, Stage
from gelslim_cad.tolerance.causes import Cause, causes, errors, no_errors
from gelslim_cad.tolerance.margins import margins, worst_margins

Array = NDArray[np.float64]
SLACK = 1e-6
"""A margin that is negative by no more than this is kept: the fold's search ends this near."""
ALL = "all"
"""The name under which fingers are counted that keep every rule."""


@dataclass(frozen=True)
class Yield:
    """How many of the sampled fingers keep a rule.

    Attributes:
        kept: Their number.
        of: The number of samples.
    """

    kept: int
    of: int

    @property
    def share(self) -> float:
        """The share that keeps the rule."""
        return self.kept / self.of

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % confidence interval for independent samples.

        Samples of a Sobol sequence are spread more evenly, so that it is rather too wide.
        """
        found = binomtest(self.kept, self.of).proportion_ci(0.95, method="wilson")
        return float(found.low), float(found.high)


@dataclass(frozen=True)
class Sampled:
    """Sampled fingers of one design, assembled in one way.

    Attributes:
        errors: Errors (n,) by the causes' names.
        places: Margins (n,) by `rule@place`.
    """

    errors: Mapping[str, Array]
    places: Mapping[str, Array]

    def yields(self) -> dict[str, Yield]:
        """Yield of each rule, and of all of them under `ALL`."""
        worst = worst_margins(self.places)
        kept = {name: v >= -SLACK for name, v in worst.items()}
        kept[ALL] = np.logical_and.reduce(list(kept.values()))
        return {name: Yield(int(k.sum()), len(k)) for name, k in kept.items()}


def probabilities(width: int, count: int, seed: int) -> Array:
    """The first `count` points (count, width) of a scrambled Sobol sequence."""
    sequence = qmc.Sobol(width, scramble=True, seed=np.random.default_rng(seed))
    return np.asarray(sequence.random_base2(math.ceil(math.log2(max(count, 2)))))[:count]


def sampled(d: Dimensions, count: int, seed: int) -> dict[Stage, Sampled]:
    """The same `count` fingers of a design in both ways of assembling them."""
    found = errors(all_causes := causes(d), probabilities(len(all_causes), count, seed))
    return {stage: Sampled(found, margins(d, found, stage)) for stage in STAGES}


def counted(d: Dimensions) -> Stage:
    """The way of assembling that the spec chose, whose yield counts."""
    return "adjusted" if d["tolerance.adjusted"] else "as_built"


def yield_of(d: Dimensions, count: int, seed: int) -> dict[str, Yield]:
    """Yields of a design in the way in which it is assembled."""
    all_causes = causes(d)
    found = errors(all_causes, probabilities(len(all_causes), count, seed))
    return Sampled(found, margins(d, found, counted(d))).yields()


def broken(d: Dimensions) -> tuple[str, ...]:
    """Rules that the design breaks without any error, so that no tolerance helps."""
    exact = worst_margins(margins(d, no_errors(d), "as_built"))
    return tuple(rule for rule, margin in exact.items() if margin[0] < -SLACK)


def by_group(all_causes: tuple[Cause, ...]) -> dict[str, list[int]]:
    """Places of the causes of each group, groups without any error left out."""
    found: dict[str, list[int]] = {}
    for k, cause in enumerate(all_causes):
        if cause.spread > 0:
            found.setdefault(cause.group, []).append(k)
    return found
