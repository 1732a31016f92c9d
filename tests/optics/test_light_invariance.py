"""What must not change an answer: place, size, handedness, order, batches, threads."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from light_cases import bend_scene, finger, transformed

from gelslim_optics.guide.profile import GuideProfile
from gelslim_optics.light.result import LightResult
from gelslim_optics.light.scene import LightScene, Medium
from gelslim_optics.light.source import LedRow
from gelslim_optics.light.trace import TraceOptions, trace_light

RAYS = 1 << 13


def values(result: LightResult) -> dict[str, float]:
    return {name: entry.value for name, entry in result.ledger().items()}


def assert_same(a: LightResult, b: LightResult, within: float) -> None:
    one, two = values(a), values(b)
    assert set(one) == set(two)
    for name, value in one.items():
        assert two[name] == pytest.approx(value, abs=within), name


@pytest.mark.parametrize("mirror", ["", "glued", "gap"])
def test_moving_by_a_metre(mirror: str) -> None:
    scene = finger(1.5, mirror=mirror)
    moved = replace(scene, profile=transformed(scene.profile, 1000.0, -700.0))
    # A ray within rounding of a branch may go the other way: one weighs 1 / RAYS.
    assert_same(trace_light(scene, RAYS), trace_light(moved, RAYS), 2e-4)


def test_scaling_by_a_thousand_with_absorption_per_length() -> None:
    scene = finger(1.5)
    f = 1000.0
    rows = tuple(
        replace(
            row,
            x_mm=tuple(f * x for x in row.x_mm),
            size_mm=f * row.size_mm,
            gap_mm=f * row.gap_mm,
        )
        for row in scene.sources
        if isinstance(row, LedRow)
    )
    media = {
        name: Medium(
            m.index, m.absorption_per_mm / f, m.red_index, m.green_index, m.blue_index, m.sellmeier
        )
        for name, m in scene.media.items()
    }
    big = LightScene(
        transformed(scene.profile, factor=f),
        (f * scene.x_mm[0], f * scene.x_mm[1]),
        (f * scene.gel_x_mm[0], f * scene.gel_x_mm[1]),
        rows,
        media,
        scene.surfaces,
    )
    a, b = trace_light(scene, RAYS), trace_light(big, RAYS)
    assert_same(a, b, 2e-4)
    assert b.irradiance().mean() * f**2 == pytest.approx(a.irradiance().mean(), rel=2e-3)


def test_mirroring_mirrors_the_map() -> None:
    scene = finger(1.5, crown_mm=0.5)
    turned = replace(scene, profile=transformed(scene.profile, mirrored=True))
    a, b = trace_light(scene, RAYS), trace_light(turned, RAYS)
    assert_same(a, b, 2e-4)
    assert np.allclose(a.irradiance("red"), b.irradiance("red")[:, ::-1], atol=1e-6)
    assert b.slope_sensitivity("red").value == pytest.approx(-a.slope_sensitivity("red").value)


def test_order_and_direction_of_the_edges() -> None:
    scene = finger(1.5)
    edges = [e.reversed() if i % 2 else e for i, e in enumerate(scene.profile.edges)]
    feet = ("foot_left", "foot_right")
    # The LEDs' first point lies by their foot's start: feet keep their direction.
    edges = [scene.profile.edge(e.name) if e.name in feet else e for e in edges]
    order = np.random.default_rng(4).permutation(len(edges))
    shuffled = replace(scene, profile=GuideProfile(tuple(edges[i] for i in order)))
    a, b = trace_light(scene, RAYS), trace_light(shuffled, RAYS)
    assert_same(a, b, 2e-4)
    assert np.allclose(a.irradiance(), b.irradiance(), atol=1e-6)


def test_the_two_sides_of_a_symmetric_finger_agree() -> None:
    ledger = trace_light(finger(2.0), 1 << 17).ledger()
    for name in ("leaked.outer_bend", "leaked.gel_side"):
        left, right = ledger[f"{name}_left"], ledger[f"{name}_right"]
        assert abs(left.value - right.value) < 5 * (left.standard_error + right.standard_error)


def test_batches_and_threads_never_change_a_bit() -> None:
    scene = finger(1.5)
    first = trace_light(scene, 1 << 16, replicates=2)
    for threads, batch in ((1, 4096), (1, 5000), (3, 1 << 16), (8, 8192)):
        other = trace_light(scene, 1 << 16, replicates=2, threads=threads, batch_rays=batch)
        assert np.array_equal(first.tallies, other.tallies)
        assert np.array_equal(first.maps, other.maps)


def test_the_seed_decides() -> None:
    scene = finger(1.5)
    again = trace_light(scene, RAYS, seed=3).tallies
    assert np.array_equal(trace_light(scene, RAYS, seed=3).tallies, again)
    assert not np.array_equal(trace_light(scene, RAYS, seed=4).tallies, again)


@pytest.mark.slow
def test_the_interval_holds_the_truth() -> None:
    """Of 40 runs about 38 intervals hold the value of a run of many more rays."""
    scene = finger(1.5)
    truth = trace_light(scene, 1 << 20, seed=99, options=TraceOptions(split=1e-3))
    held = 0
    for seed in range(40):
        delivered = trace_light(scene, 1 << 12, seed=seed).ledger()["delivered"]
        held += delivered.low <= truth.value("delivered") <= delivered.high
    assert 33 <= held <= 40


def test_sobol_beats_chance() -> None:
    scene = bend_scene(1.5, 1.0, planar=False)
    errors = {}
    for sampling in ("sobol", "random"):
        runs = [trace_light(scene, 1 << 15, seed=s, sampling=sampling) for s in range(6)]
        errors[sampling] = np.mean([r.ledger()["delivered"].standard_error for r in runs])
    assert errors["sobol"] < errors["random"] / 4


def test_the_compiler_is_loaded_only_to_trace() -> None:
    code = (
        "import sys, gelslim_optics.light.trace as t; sys.exit('numba' in sys.modules or t is None)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
