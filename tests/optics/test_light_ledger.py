"""Every figure of a result from random tallies, by its definition."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from gelslim_optics.light import trace_geometry as column
from gelslim_optics.light.result import Estimate, LightResult, estimate, paired_ratio

EDGES = ("foot", "face", "wall")
COLOURS = ("red", "green", "red")
SHARES = (0.2, 0.5, 0.3)
REPLICATES = 5
# What each colour counts: the sources of that colour, weighted so that they emit a flux of 1.
WEIGHTS = {None: [0.2, 0.5, 0.3], "red": [0.4, 0.0, 0.6], "green": [0.0, 1.0, 0.0]}


def result(seed: int = 1, replicates: int = REPLICATES) -> LightResult:
    rng = np.random.default_rng(seed)
    tallies = rng.uniform(0.1, 1.0, (3, replicates, column.columns(len(EDGES))))
    maps = rng.uniform(0.0, 1.0, (3, replicates, 11, 21))
    return LightResult(
        COLOURS,
        SHARES,
        EDGES,
        "face",
        1000,
        tallies,
        maps,
        0.25,
        np.zeros((len(COLOURS), 1, 1, 1, 1, 3)),
    )


def weighted(values: np.ndarray, colour: str | None) -> np.ndarray:
    return sum(w * v for w, v in zip(WEIGHTS[colour], values, strict=True))


def interval(values: np.ndarray) -> Estimate:
    mean, error = np.mean(values), stats.sem(values)
    low, high = stats.t.interval(0.95, len(values) - 1, mean, error)
    return Estimate(float(mean), float(error), float(low), float(high))


def same(found: Estimate, expected: Estimate) -> None:
    assert vars(found) == pytest.approx(vars(expected), rel=1e-12)


def test_estimates_are_students_intervals() -> None:
    values = np.random.default_rng(2).normal(3.0, 2.0, 7)
    same(estimate(values), interval(values))
    alone = estimate(np.array([4.0]))
    assert (alone.value, alone.standard_error) == (4.0, math.inf)
    assert (alone.low, alone.high) == (-math.inf, math.inf)
    two = np.array([1.0, 4.0])
    same(estimate(two), interval(two))


PLACES = {
    "absorbed": column.ABSORBED,
    "missed_foot": column.MISSED,
    "foot_reflection": column.FOOT_REFLECTION,
    "truncated": column.TRUNCATED,
    "lost": column.LOST,
    "leaked.ends": column.ENDS,
    "leaked.gel_ends": column.GEL_ENDS,
    "stopped.ends": column.ENDS_STOPPED,
    "leaked.foot": column.PER_EDGE,
    "leaked.face": column.PER_EDGE + 1,
    "leaked.wall": column.PER_EDGE + 2,
    "stopped.foot": column.PER_EDGE + 3,
    "delivered": column.PER_EDGE + 4,
    "stopped.wall": column.PER_EDGE + 5,
    "returned.foot": column.PER_EDGE + 6,
    "returned.face": column.PER_EDGE + 7,
    "returned.wall": column.PER_EDGE + 8,
}


@pytest.mark.parametrize("colour", WEIGHTS)
def test_ledger_entries_are_weighted_columns(colour: str | None) -> None:
    r = result()
    sums = weighted(r.tallies, colour)
    ledger = r.ledger(colour)
    assert set(ledger) == set(PLACES)
    for name, place in PLACES.items():
        same(ledger[name], interval(sums[:, place]))
        np.testing.assert_allclose(r.replicates(name, colour), sums[:, place], rtol=1e-14)
        assert r.value(name, colour) == pytest.approx(np.mean(sums[:, place]), rel=1e-14)
    for group in ("leaked", "stopped", "returned"):
        chosen = [k for name, k in PLACES.items() if name.startswith(group)]
        same(r.total(group, colour), interval(sums[:, chosen].sum(axis=1)))
    same(r.arrived(colour), interval(sums[:, column.ARRIVED]))
    same(r.entered_gel(colour), interval(sums[:, column.ENTERED_GEL]))
    arrived = r.replicates("arrived", colour)
    np.testing.assert_allclose(arrived, sums[:, column.ARRIVED], rtol=1e-14)


def test_edges_without_light_are_left_out_and_other_entries_are_not() -> None:
    r = result()
    r.tallies[:, :, [PLACES["leaked.wall"], PLACES["truncated"]]] = 0.0
    assert set(r.ledger()) == set(PLACES) - {"leaked.wall"}
    with pytest.raises(KeyError, match="nowhere"):
        r.replicates("nowhere")
    with pytest.raises(KeyError, match="blue"):
        r.ledger("blue")


def test_directions_are_the_mean_of_each_replicates_ratio() -> None:
    r = result()
    for colour in WEIGHTS:
        sums = weighted(r.tallies, colour)
        per_arrival = sums / sums[:, [column.ARRIVED]]
        same(r.elevation_deg(colour), interval(np.degrees(per_arrival[:, column.ELEVATION])))
        same(r.slope_sensitivity(colour), interval(per_arrival[:, column.SLOPE]))
    r.tallies[:, 2, column.ARRIVED] = 0.0
    assert math.isnan(r.elevation_deg().value)


def test_faces_and_corners_are_counted_per_ray() -> None:
    r = result()
    assert r.crossings == pytest.approx(r.tallies[:, :, column.CROSSINGS].mean())
    assert r.corners == pytest.approx(r.tallies[:, :, column.CORNERS].mean())


def test_the_gap_is_that_of_the_worst_replicate() -> None:
    r = result()
    sums = r.tallies[:, :, list(PLACES.values())].sum(axis=2)
    assert r.ledger_gap() == pytest.approx(np.abs(sums - 1).max(), rel=1e-13)
    r.tallies[...] = 0.0
    assert r.ledger_gap() == 1.0


def test_irradiance_is_the_weighted_flux_per_area() -> None:
    r = result()
    for colour in WEIGHTS:
        expected = weighted(r.maps.mean(axis=1), colour) / 0.25
        np.testing.assert_allclose(r.irradiance(colour), expected, rtol=1e-13)


def test_uniformity_leaves_the_replicates_own_noise_out() -> None:
    """Squares from pairs of replicates, the darkest patch where the other replicates see it."""
    r = result()
    for colour in WEIGHTS:
        maps = weighted(r.maps, colour)
        maps = maps / maps.mean()
        pairs = [(i, j) for i in range(REPLICATES) for j in range(REPLICATES) if i != j]
        square = np.mean([np.mean(maps[i] * maps[j]) for i, j in pairs])
        mean_square = np.mean([maps[i].mean() * maps[j].mean() for i, j in pairs])
        # 11 x 21 bins as 8 x 8 patches: the first ones have one bin more.
        patches = np.array(
            [
                [
                    [block.mean() for block in np.array_split(row, 8, axis=1)]
                    for row in np.array_split(one, 8, axis=0)
                ]
                for one in maps
            ]
        ).reshape(REPLICATES, -1)
        darkest = [
            patches[k, np.argmin(np.delete(patches, k, axis=0).sum(axis=0))]
            for k in range(REPLICATES)
        ]
        found = r.uniformity(colour)
        assert found.cv == pytest.approx(math.sqrt(max(square - mean_square, 0.0)), rel=1e-9)
        assert found.min_over_mean == pytest.approx(np.mean(darkest), rel=1e-12)


def test_a_single_replicate_keeps_its_noise() -> None:
    r = result(replicates=1)
    maps = weighted(r.maps, None)[0]
    found = r.uniformity()
    assert found.cv == pytest.approx(np.std(maps) / np.mean(maps), rel=1e-12)
    two = result(replicates=2)
    assert two.uniformity().cv != pytest.approx(np.std(two.irradiance()) / two.irradiance().mean())


def test_paired_ratio_has_the_error_of_its_linearisation() -> None:
    ours, other = result(3), result(4)
    a, b = ours.replicates("delivered"), other.replicates("delivered")
    ratio = a.mean() / b.mean()
    error = stats.sem(a - ratio * b) / b.mean()
    low, high = stats.t.interval(0.95, REPLICATES - 1, ratio, error)
    same(paired_ratio(ours, other), Estimate(ratio, error, low, high))
    other.tallies[:, :, PLACES["delivered"]] = 0.0
    with pytest.raises(ValueError, match="undefined"):
        paired_ratio(ours, other)
