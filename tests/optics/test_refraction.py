"""Exact refraction through flat layers, against a bracketing solver and Snell's law."""

from __future__ import annotations

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from gelslim_optics.camera import rays, refraction_kernel, refraction_newton
from gelslim_optics.camera.rays import as_points, check_above, ray_slope
from gelslim_optics.camera.refraction import Layer, LayerStack, lateral_reach, reach_growth
from gelslim_optics.camera.refraction_newton import newton_slope

LAYERS = [
    ([8.0], [1.0]),
    ([15.0, 2.5, 2.0], [1.0, 1.49, 1.41]),
    ([2.0, 10.0, 15.0], [1.0, 1.49, 1.41]),
    ([0.5, 3.0, 1.0, 4.0], [1.0, 2.4, 1.3, 1.0]),
]


def reach_by_snell(angle: float, heights: list[float], indices: list[float]) -> float:
    return sum(
        h * math.tan(math.asin(math.sin(angle) / n)) for h, n in zip(heights, indices, strict=True)
    )


def bracketed(reach: float, heights: list[float], indices: list[float]) -> float:
    def off(angle: float) -> float:
        return reach_by_snell(angle, heights, indices) - reach

    return float(brentq(off, 0.0, math.pi / 2 - 1e-9, xtol=1e-16, rtol=9e-16))


@pytest.mark.parametrize(("heights", "indices"), LAYERS)
def test_ray_slope_agrees_with_a_bracketing_solver(
    heights: list[float], indices: list[float]
) -> None:
    # From almost normal to 200 times the stack's height: 89.7° and more from the normal.
    total = sum(heights)
    reaches = total * np.concatenate([np.geomspace(1e-9, 1e-2, 12), np.geomspace(0.02, 200, 30)])
    angles = np.arctan(ray_slope(reaches, heights, indices))
    truth = np.array([bracketed(r, heights, indices) for r in reaches])
    assert np.abs(angles - truth).max() < 1e-12


def test_the_normal_ray_stays_normal_and_small_reaches_keep_their_digits() -> None:
    heights, indices = LAYERS[1]
    assert ray_slope(0.0, heights, indices) == 0.0
    paraxial = sum(h / n for h, n in zip(heights, indices, strict=True))
    for reach in (1e-3 * 1e-9, 1e-12, 1e-100):
        assert float(ray_slope(reach, heights, indices)) == pytest.approx(
            reach / paraxial, rel=1e-12
        )


def test_reach_and_slope_invert_each_other_on_both_sides() -> None:
    slopes = np.concatenate([-np.geomspace(50, 1e-6, 40), [0.0], np.geomspace(1e-6, 50, 40)])
    for heights, indices in LAYERS:
        reach = lateral_reach(slopes, heights, indices)
        np.testing.assert_array_equal(np.sign(reach), np.sign(slopes))
        np.testing.assert_allclose(ray_slope(reach, heights, indices), slopes, rtol=1e-11)


def test_reach_follows_snells_law() -> None:
    for heights, indices in LAYERS:
        for angle in (0.01, 0.4, 0.9, 1.3, 1.5):
            assert float(lateral_reach(math.tan(angle), heights, indices)) == pytest.approx(
                reach_by_snell(angle, heights, indices), rel=1e-12
            )


def test_layers_that_vary_from_ray_to_ray_broadcast() -> None:
    heights = [np.array([10.0, 12.0, 14.0]), 2.5, np.array([2.0, 1.8, 1.0])]
    indices = [1.0, 1.49, 1.41]
    reaches = np.array([3.0, -7.0, 20.0])
    together = ray_slope(reaches, heights, indices)
    for k in range(3):
        alone = ray_slope(reaches[k], [heights[0][k], 2.5, heights[2][k]], indices)
        assert together[k] == pytest.approx(float(alone), rel=1e-14)


def test_reach_is_concave_in_the_slope_and_below_the_straight_ray() -> None:
    # What lets Newton climb to the root without passing it.
    t = np.linspace(0, 30, 3001)
    for heights, indices in LAYERS:
        reach = lateral_reach(t, heights, indices)
        assert np.all(np.diff(reach) > 0)
        assert np.all(np.diff(reach, 2) < 1e-10)
        assert np.all(reach <= t * sum(heights) + 1e-9)


@pytest.mark.parametrize("air_mm", [0.0, -1.0])
def test_a_camera_without_air_before_it_is_refused(air_mm: float) -> None:
    with pytest.raises(ValueError, match="air gap"):
        ray_slope(1.0, [air_mm, 2.0], [1.0, 1.49])


# Grazing: thin and thick air, an index next to 1, high ones, a layer of no height.
GRAZING = [
    ([8.0], [1.0]),
    ([15.0, 2.5, 2.0], [1.0, 1.49, 1.41]),
    ([0.01, 2.5, 2.0], [1.0, 1.49, 1.41]),
    ([1e-4, 10.0], [1.0, 1.49]),
    ([3.0, 20.0, 5.0], [1.0, 1.0 + 1e-9, 4.0]),
    ([3.0, 2.0, 0.0, 1.0], [1.0, 1.0, 2.0, 1.0 + 2**-52]),
]


def decimal_reach(slope: Decimal, heights: list[float], indices: list[float]) -> Decimal:
    """Snell's law in 60 digits: sin θi = sin θ0 / n, tan θi = sin θi / cos θi."""
    square = slope * slope / (1 + slope * slope)
    total = Decimal(0)
    for h, n in zip(heights, indices, strict=True):
        inside = square / (Decimal(n) * Decimal(n))
        total += Decimal(h) * (inside / (1 - inside)).sqrt()
    return total


def bisected(reach: float, heights: list[float], indices: list[float]) -> Decimal:
    """Slope of the ray, by bisection of its logarithm between the bounds 0 < t <= n r / h."""
    goal = Decimal(reach)
    low = goal / Decimal(sum(heights))
    high = goal * max(Decimal(n) for n in indices) / Decimal(heights[0])
    for _ in range(110):
        middle = (low * high).sqrt()
        if decimal_reach(middle, heights, indices) < goal:
            low = middle
        else:
            high = middle
    return low


def angle_between(slopes: NDArray[np.float64], truth: list[Decimal]) -> NDArray[np.float64]:
    """tan(a - b) = (tan a - tan b) / (1 + tan a tan b), in 60 digits."""
    return np.array(
        [
            float((Decimal(float(s)) - t) / (1 + Decimal(float(s)) * t))
            for s, t in zip(slopes, truth, strict=True)
        ]
    )


@pytest.mark.parametrize(("heights", "indices"), GRAZING)
def test_angles_hold_from_the_normal_to_grazing(heights: list[float], indices: list[float]) -> None:
    with localcontext() as context:
        context.prec = 60
        reaches = np.geomspace(1e-12, 1e9, 64)
        truth = [bisected(r, heights, indices) for r in reaches]
        slopes = ray_slope(reaches, heights, indices)
        assert slopes[-1] > 1e7
        assert np.abs(angle_between(slopes, truth)).max() < 1e-13


@pytest.mark.parametrize(("heights", "indices"), GRAZING)
def test_slopes_far_beyond_grazing_come_back(heights: list[float], indices: list[float]) -> None:
    with localcontext() as context:
        context.prec = 60
        slopes = [Decimal(float(t)) for t in np.geomspace(1e-14, 1e14, 113)]
        reaches = np.array([float(decimal_reach(t, heights, indices)) for t in slopes])
        assert np.abs(angle_between(ray_slope(reaches, heights, indices), slopes)).max() < 1e-13


def test_an_index_of_one_gives_the_straight_ray() -> None:
    reaches = np.geomspace(1e-9, 1e9, 50)
    slopes = ray_slope(reaches, [3.0, 2.0, 5.0], [1.0, 1.0, 1.0])
    np.testing.assert_allclose(slopes, reaches / 10, rtol=4e-16)


def test_compiled_loop_gives_the_same_digits() -> None:
    rng = np.random.default_rng(1)
    n = 40_000
    signed = np.concatenate([rng.uniform(-40, 40, n // 2), -np.geomspace(1e-300, 1e145, n // 2)])
    signed[:3] = 0.0, -0.0, np.nan
    for heights, indices in [*LAYERS, *GRAZING, ([rng.uniform(1, 9, n), 2.0], [1.0, 1.5])]:
        h = [np.asarray(v, dtype=float) for v in heights]
        m = [np.asarray(v, dtype=float) for v in indices]
        compiled = ray_slope(signed, h, m)
        plain = np.copysign(newton_slope(np.abs(signed), h, m), signed)
        np.testing.assert_allclose(compiled, plain, rtol=1e-15, atol=0)
        assert np.isfinite(compiled[3:]).all()
        assert np.isnan(compiled[2])


def test_compiled_loop_broadcasts_like_the_plain_one() -> None:
    rng = np.random.default_rng(2)
    reach = rng.uniform(-20, 20, (200, 1))
    air, gel = rng.uniform(10, 12, (1, 150)), rng.uniform(1, 2, (200, 150))
    index = rng.uniform(1.3, 1.6, (200, 1))
    together = ray_slope(reach, [air, 2.5, gel], [1.0, 1.49, index])
    assert together.shape == (200, 150)
    for i in (0, 77, 199):
        row = ray_slope(reach[i], [air[0], 2.5, gel[i]], [1.0, 1.49, index[i]])
        np.testing.assert_allclose(together[i], row, rtol=1e-15)


def test_growth_is_the_derivative_of_the_reach() -> None:
    for heights, indices in LAYERS:
        for slope in (0.0, 0.3, 2.0, 30.0):
            h = 1e-4 * (1 + slope)
            r = [lateral_reach(slope + k * h, heights, indices) for k in (-2, -1, 1, 2)]
            fourth = (r[0] - 8 * r[1] + 8 * r[2] - r[3]) / (12 * h)
            assert float(reach_growth(slope, heights, indices)) == pytest.approx(fourth, rel=1e-9)


@pytest.mark.parametrize(
    ("reach", "heights", "indices", "message"),
    [
        (1.0, [5.0, 2.0], [1.0, 0.9], "index"),
        (1.0, [5.0, 2.0], [1.0, math.nan], "index"),
        (1.0, [5.0, -2.0], [1.0, 1.4], "height"),
        (1.0, [5.0, math.inf], [1.0, 1.4], "height"),
        (1.0, [5.0, 2.0], [1.33, 1.4], "layer 0"),
        (1.0, [5.0, 2.0], [1.0], "one of each"),
        (1.0, [], [], "one of each"),
        (1e200, [5.0], [1.0], "limit"),
        (math.inf, [5.0], [1.0], "limit"),
        (1.0, [math.nan], [1.0], "air gap"),
    ],
)
def test_layers_that_make_no_sense_are_refused(
    reach: float, heights: list[float], indices: list[float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        ray_slope(reach, heights, indices)


def test_short_arrays_take_the_plain_way_and_long_ones_the_compiled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    taken: list[str] = []

    def spy(name: str, module: object) -> None:
        original = getattr(module, name)

        def noted(*arguments: object) -> object:
            taken.append(name)
            return original(*arguments)

        monkeypatch.setattr(module, name, noted)

    spy("newton_slope", rays)
    spy("newton_rays", rays)
    spy("solve_slopes", refraction_kernel)
    spy("solve_rays", refraction_kernel)
    for size, expected in ((19_999, "newton_slope"), (20_000, "solve_slopes")):
        ray_slope(np.linspace(-3, 3, size), [5.0, 2.0], [1.0, 1.5])
        assert taken == [expected]
        taken.clear()
    stack = LayerStack.above(-20.0, -4.0, (Layer(2.0, 1.5), Layer(2.0, 1.4)))
    pinhole = np.array([0.3, -0.2, -20.0])
    for size, expected in ((19_999, "newton_rays"), (20_000, "solve_rays")):
        points = np.column_stack([np.linspace(-3, 3, size), np.ones(size), np.zeros(size)])
        found = rays.rays_on_axes(pinhole, stack, np.eye(3), points)
        assert taken[0] == expected
        taken.clear()
        # The same rays by the other function, point by point.
        some = slice(0, size, 1111)
        slopes = rays.air_slopes(pinhole, stack, points[some])
        np.testing.assert_allclose(found[some], np.column_stack([slopes, np.ones(len(slopes))]))
        taken.clear()


@pytest.mark.parametrize(("heights", "indices"), [*LAYERS, *GRAZING])
def test_newton_needs_few_steps_because_it_starts_near_the_root(
    heights: list[float], indices: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    slopes = np.geomspace(1e-3, 1e7, 60)
    reaches = lateral_reach(slopes, heights, indices)
    steps = 7 if heights[0] >= 0.5 else 16
    monkeypatch.setattr(refraction_newton, "MAX_NEWTON_STEPS", steps)
    angles = np.arctan(ray_slope(reaches, heights, indices))
    np.testing.assert_allclose(angles, np.arctan(slopes), rtol=0, atol=1e-12)


def test_reaches_up_to_the_limit_are_solved_and_above_it_refused() -> None:
    air = np.array([2.0, 5.0])
    assert np.isfinite(ray_slope(air * 0.99e150, [air, 2.0], [1.0, 1.5])).all()
    with pytest.raises(ValueError, match="limit"):
        ray_slope(air * [0.5e150, 1.01e150], [air, 2.0], [1.0, 1.5])
    with pytest.raises(ValueError, match="limit"):
        ray_slope([1.0, -1e151], [5.0, 2.0], [1.0, 1.5])
    # An index of 1 and a layer of no height are the least that is allowed.
    assert ray_slope(3.0, [2.0, 0.0, 1.0], [1.0, 1.0, 1.0]) == pytest.approx(1.0)


def test_points_have_three_coordinates() -> None:
    assert as_points([1.0, 2.0, 3.0]).shape == (1, 3)
    assert as_points(np.zeros((5, 3))).shape == (5, 3)
    for wrong in (np.zeros((5, 2)), np.zeros((2, 5, 3)), np.zeros(4)):
        with pytest.raises(ValueError, match="shape"):
            as_points(wrong)
    check_above(np.array([0.0, 0.0, -2.0]), np.array([-1.999, 3.0, np.nan]))
    for low in (-2.0, -2.5):
        with pytest.raises(ValueError, match="1 of 2 points"):
            check_above(np.array([0.0, 0.0, -2.0]), np.array([low, 3.0]))


def test_a_stack_knows_its_media_at_every_height() -> None:
    stack = LayerStack.above(-20.0, -4.5, (Layer(2.5, 1.49), Layer(2.0, 1.41)))
    assert stack.tops_mm == (-4.5, -2.0, math.inf)
    assert stack.indices == (1.0, 1.49, 1.41)
    z = np.array([-19.0, -4.5, -3.0, -2.0, 0.0, 5.0])
    np.testing.assert_array_equal(stack.index_at(z), [1.0, 1.49, 1.49, 1.41, 1.41, 1.41])
    crossed = np.array(stack.crossed_mm(z))
    np.testing.assert_allclose(crossed[0], [1.0, 15.5, 15.5, 15.5, 15.5, 15.5])
    np.testing.assert_allclose(crossed[1], [0, 0, 1.5, 2.5, 2.5, 2.5])
    np.testing.assert_allclose(crossed[2], [0, 0, 0, 0, 2.0, 7.0])
    for wrong in ((-1e-9, 1.4), (math.inf, 1.4), (1.0, 0.999), (1.0, math.nan)):
        with pytest.raises(ValueError, match="of a layer must be"):
            Layer(*wrong)
    assert Layer(0.0, 1.0).thickness_mm == 0
