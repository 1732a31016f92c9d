"""Which causes a margin's variance comes from: a linear screen, and Sobol's indices to check it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import sobol_indices

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.tolerance.assembly import Stage
from gelslim_cad.tolerance.causes import causes, errors
from gelslim_cad.tolerance.margins import margins, rule_of
from gelslim_cad.tolerance.yields import Sampled, by_group, probabilities

Array = NDArray[np.float64]
SOBOL_SAMPLES = 1024
LEAST_DEVIATION = 1e-9
"""A margin that varies less has no causes."""


@dataclass(frozen=True)
class Shares:
    """Causes of the variance of one margin, by group.

    Attributes:
        place: The margin, `rule@place`.
        mean: Its mean over the samples.
        deviation: Its standard deviation.
        linear: Squared standardised coefficients of a linear regression on all errors.
        r_squared: Part of the variance that the regression explains.
        worst_case: The margin, by this regression, with every error at its limit and against the
            finger; a normal error counts with three standard deviations.
        first: Sobol's first-order indices; empty where they were not asked for.
        total: Sobol's total indices.
    """

    place: str
    mean: float
    deviation: float
    linear: Mapping[str, float]
    r_squared: float
    worst_case: float
    first: Mapping[str, float]
    total: Mapping[str, float]

    @property
    def rule(self) -> str:
        """The rule of the margin."""
        return rule_of(self.place)


def worst_places(found: Sampled) -> tuple[str, ...]:
    """Of each rule the place that fails most; of equal ones that with the least margin."""
    worst: dict[str, tuple[float, float, str]] = {}
    for place, margin in found.places.items():
        deviation = max(float(margin.std()), LEAST_DEVIATION)
        key = (-float((margin < 0).mean()), float(margin.mean()) / deviation, place)
        rule = rule_of(place)
        worst[rule] = min(worst.get(rule, key), key)
    return tuple(key[2] for key in worst.values())


def linear_shares(d: Dimensions, found: Sampled, place: str) -> Shares:
    """Regress the margin of one place on all errors.

    For independent errors the square of a standardised coefficient is the part of the variance
    that its error explains, as far as the margin is linear, which R² tells.
    """
    all_causes = causes(d)
    margin = found.places[place]
    groups = by_group(all_causes)
    active = [k for members in groups.values() for k in members]
    spread = float(margin.std())
    empty = dict.fromkeys(groups, 0.0)
    if spread < LEAST_DEVIATION or not active:
        mean = float(margin.mean())
        return Shares(place, mean, spread, empty, 1.0, mean, {}, {})
    columns = np.stack([found.errors[all_causes[k].name] for k in active], axis=1)
    columns = columns - columns.mean(axis=0)
    fitted, *_ = np.linalg.lstsq(columns, margin - margin.mean(), rcond=None)
    parts = dict(zip(active, (fitted * columns.std(axis=0) / spread) ** 2, strict=True))
    left = margin - margin.mean() - columns @ fitted
    return Shares(
        place,
        float(margin.mean()),
        spread,
        {group: float(sum(parts[k] for k in members)) for group, members in groups.items()},
        float(1 - left.var() / margin.var()),
        float(margin.mean() - np.abs(fitted) @ [all_causes[k].limit for k in active]),
        {},
        {},
    )


def sobol_shares(
    d: Dimensions, stage: Stage, places: Sequence[str], seed: int, count: int = SOBOL_SAMPLES
) -> dict[str, tuple[dict[str, float], dict[str, float]]]:
    """Sobol's first-order and total indices of the margins of some places, by group of causes.

    Args:
        d: Dimensions of the design.
        stage: How the fingers are assembled.
        places: The margins.
        seed: Seed of the samples.
        count: Number of samples of each of the groups + 2 matrices, a power of two.

    Returns:
        First-order and total index of each group by place.
    """
    all_causes = causes(d)
    groups = by_group(all_causes)
    both = probabilities(2 * len(all_causes), count, seed)
    a, b = both[:, : len(all_causes)], both[:, len(all_causes) :]

    def values(u: Array) -> Array:
        found = margins(d, errors(all_causes, u), stage)
        # SciPy fails for a single margin of a single group: the first one stands there twice.
        return np.stack([found[place] for place in (places[0], *places)])

    none = dict.fromkeys(groups, 0.0)
    if not groups or not places:
        return dict.fromkeys(places, (none, none))
    mixed = []
    for members in groups.values():
        columns = a.copy()
        columns[:, members] = b[:, members]
        mixed.append(values(columns))
    of_a, of_b = values(a), values(b)
    indices = sobol_indices(func={"f_A": of_a, "f_B": of_b, "f_AB": np.stack(mixed)}, n=count)
    still = np.std(np.concatenate([of_a, of_b], axis=1), axis=1) < LEAST_DEVIATION
    first, total = (
        np.where(still[:, None], 0.0, np.reshape(of, (len(places) + 1, len(groups))))
        for of in (indices.first_order, indices.total_order)
    )
    return {
        place: (
            dict(zip(groups, first[k].tolist(), strict=True)),
            dict(zip(groups, total[k].tolist(), strict=True)),
        )
        for k, place in enumerate(places, start=1)
    }
