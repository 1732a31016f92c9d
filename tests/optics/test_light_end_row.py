"""Rows of LEDs before an end face: closed forms, Monte Carlo, symmetry, reciprocity, misses."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from light_cases import COATS, N_ACRYLIC, finger, media, slab, transformed
from numpy.typing import NDArray

from gelslim_optics.guide.profile import Arc, Edge, GuideProfile, Segment
from gelslim_optics.guide.shapes import CurvedGuide, GelSection, MirrorGuide, mirror_profile
from gelslim_optics.guide.shapes import curved_profile as curved
from gelslim_optics.light.launch import launch, launch_medium
from gelslim_optics.light.result import LightResult
from gelslim_optics.light.scene import LightScene, Medium
from gelslim_optics.light.source import Dome, EdgeLaunch, EndRow
from gelslim_optics.light.trace import TraceOptions, trace_light, trace_paths

Array = NDArray[np.float64]
ENDS: tuple[Literal["first", "last"], ...] = ("first", "last")
RAYS = 1 << 14


def bar(
    half_mm: float,
    thick_mm: float,
    half_length_mm: float,
    row: EndRow,
    index: float = N_ACRYLIC,
    top: str = "air",
) -> LightScene:
    """A straight bar of rectangular section about x = 0, its lower face at z = 0."""
    guide = {**media(), "acrylic": Medium(index)}
    box = (-half_length_mm, half_length_mm)
    return LightScene(
        slab(half_mm, thick_mm, top), box, box, (row,), guide, COATS, feet=(), face="top"
    )


def fresnel(sine: Array, n: float) -> Array:
    """Reflectance from the angles, for light from air."""
    i, t = np.arcsin(sine), np.arcsin(sine / n)
    rs, rp = np.sin(i - t) / np.sin(i + t), np.tan(i - t) / np.tan(i + t)
    return np.asarray((rs**2 + rp**2) / 2)


def disc(steps: int = 1200) -> tuple[Array, Array, Array]:
    """Directions of a Lambertian lamp: evenly over the disc of two cosines, and the sine."""
    radius = np.sqrt((np.arange(steps) + 0.5) / steps)
    turn = 2 * math.pi * (np.arange(steps) + 0.5) / steps
    return np.outer(radius, np.cos(turn)), np.outer(radius, np.sin(turn)), radius[:, None]


@pytest.mark.parametrize("end", ENDS)
def test_a_dense_bar_guides_all_light_that_enters(end: Literal["first", "last"]) -> None:
    """With n² > 2 no ray that enters an end can leave by a side."""
    row = EndRow(end, (-0.5, 1.2), 1.0, size_mm=0.6, gap_mm=0.0)
    result = trace_light(bar(3.0, 2.0, 20.0, row), RAYS, seed=2)
    _, _, sine = disc()
    reflected = float(np.mean(fresnel(sine, N_ACRYLIC)))
    assert result.value("missed_foot") == 0
    assert result.value("foot_reflection") == pytest.approx(reflected, abs=2e-4)
    assert result.value("leaked.ends") == pytest.approx(1 - result.value("foot_reflection"))
    assert result.total("leaked").value == pytest.approx(result.value("leaked.ends"), abs=1e-12)


def test_the_share_that_a_thin_medium_guides_is_a_disc_less_four_caps() -> None:
    """Light is guided where n² - 1 exceeds the squared cosines outside, along y and along z."""
    n = 1.3
    row = EndRow("last", (0.0,), 1.0, size_mm=1.9, gap_mm=0.0)
    result = trace_light(bar(1.0, 2.0, 400.0, row, n), 1 << 14, seed=3)
    across, up, sine = disc()
    limit = math.sqrt(n * n - 1)
    guided = (np.abs(across) <= limit) & (np.abs(up) <= limit)
    cap = math.acos(limit) - limit * math.sqrt(1 - limit * limit)
    assert np.mean(guided) == pytest.approx(1 - 4 * cap / math.pi, abs=1e-4)
    entering = guided * (1 - fresnel(sine, n))
    # What is not guided meets a side at least 100 times and loses 1 % or more each time.
    assert result.value("leaked.ends") == pytest.approx(float(np.mean(entering)), abs=2e-3)


@pytest.mark.parametrize("gap_mm", [0.0, 0.5])
def test_irradiance_of_a_black_pad_agrees_with_a_monte_carlo_of_unfolded_paths(
    gap_mm: float,
) -> None:
    """A wide plate whose upper face is a black pad: a ray goes down and up once, at most.

    At an end face it is reflected as on its way in, because both are parallel.
    """
    thick, half = 2.0, 12.0
    row = EndRow("last", (0.0,), 0.8, size_mm=1.0, gap_mm=gap_mm)
    scene = bar(1e4, thick, half, row, top="paint")
    rays = 1 << 17
    result = trace_light(scene, rays, seed=4, options=TraceOptions(bins=(24, 1)))

    random = np.random.default_rng(5)
    count = 1_000_000
    sine, turn = np.sqrt(random.random(count)), 2 * math.pi * random.random(count)
    height = 0.8 + random.uniform(-0.5, 0.5, count)
    height += gap_mm * np.tan(np.arcsin(sine)) * np.sin(turn)
    entered = (height >= 0) & (height <= thick)
    back = fresnel(sine, N_ACRYLIC)
    weight = np.where(entered, 1 - back, 0.0)
    along = np.sqrt(1 - (sine / N_ACRYLIC) ** 2)
    rise = sine / N_ACRYLIC * np.sin(turn)
    climb = np.where(rise > 0, thick - height, thick + height)
    reach = climb * along / np.abs(rise)
    bins = np.zeros(24)
    for passed in range(4):
        off = reach - 2 * half * passed
        x = half - off if passed % 2 == 0 else off - half
        bins += np.histogram(x, 24, (-half, half), weights=weight * back**passed)[0]

    # Five standard deviations of both counts; Sobol points do not scatter more than random ones.
    gap = result.maps.mean(axis=(0, 1))[:, 0] - bins / count
    assert np.all(np.abs(gap) < 5 * np.sqrt(bins / count * (1 / rays + 1 / count)))
    assert result.value("missed_foot") == pytest.approx(1 - np.mean(entered), abs=2e-3)
    assert result.arrived().value == pytest.approx(bins.sum() / count, abs=2e-3)
    assert bins.max() > 10 * bins[0] > 0


def test_a_row_at_the_first_end_mirrors_one_at_the_last() -> None:
    scene = finger(3.0, crown_mm=0.8, gel_part=0.7)
    lit = [
        trace_light(
            replace(scene, sources=(EndRow(end, (-5.0, 0.0, 5.0), -1.0, gap_mm=0.2),)), RAYS
        )
        for end in ENDS
    ]
    np.testing.assert_allclose(lit[0].maps, lit[1].maps[:, :, ::-1], atol=1e-4)
    for entry, found in lit[0].ledger().items():
        assert lit[1].value(entry) == pytest.approx(found.value, abs=1e-4), entry
    first, last = (found.slope_sensitivity(axis="x").value for found in lit)
    assert first == pytest.approx(-last, rel=1e-3)
    # Light that travels to -x brightens a facet that rises towards +x, where it comes from.
    assert last > 1
    assert abs(lit[0].slope_sensitivity(axis="y").value) < 0.05


def test_reciprocity_between_the_lamp_and_a_black_pad() -> None:
    """Flux lamp to pad times the lamp's area is flux pad to lamp times the pad's, times n²."""
    side, length = 2.0, 6.0
    row = EndRow("last", (0.0,), side / 2, size_mm=side, gap_mm=0.0)
    there = bar(side / 2, side, length / 2, row, top="paint")
    back = replace(there, sources=(EdgeLaunch("top"),))
    forward = trace_light(there, 1 << 16, seed=6).value("delivered")
    # Both ends are alike: the row before one of them receives half of what leaves by them.
    backward = trace_light(back, 1 << 16, seed=7).value("leaked.ends") / 2
    ratio = forward * side**2 / (backward * side * length * N_ACRYLIC**2)
    assert ratio == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("end", ENDS)
@pytest.mark.parametrize("gap_mm", [0.0, 0.6])
def test_each_ray_follows_its_four_numbers(end: Literal["first", "last"], gap_mm: float) -> None:
    """Place on the LED, cone of Lambert's law, way through the gap, Snell and Fresnel."""
    scene = finger(3.0, gel_part=0.6)
    row = EndRow(end, (-6.0, 1.0, 11.5), -0.9, size_mm=1.7, gap_mm=gap_mm)
    points = np.random.default_rng(8).random((300, 4))
    plane, inward = (-10.0, 1.0) if end == "first" else (10.0, -1.0)
    for (a, b, c, d), ray in zip(points, launch(scene, row, points), strict=True):
        led = min(int(3 * a), 2)
        angle, turn = math.acos(math.sqrt(1 - c)), 2 * math.pi * d
        y = row.y_mm[led] + (3 * a - led - 0.5) * 1.7 + gap_mm * math.tan(angle) * math.cos(turn)
        z = -0.9 + (b - 0.5) * 1.7 + gap_mm * math.tan(angle) * math.sin(turn)
        inside = math.asin(math.sin(angle) / N_ACRYLIC)
        np.testing.assert_allclose(ray[:3], [plane, y, z], atol=1e-9)
        way = [math.sin(inside) * math.cos(turn), math.sin(inside) * math.sin(turn)]
        np.testing.assert_allclose(ray[3:6], [inward * math.cos(inside), *way], atol=1e-12)
        rs = math.sin(angle - inside) / math.sin(angle + inside)
        rp = math.tan(angle - inside) / math.tan(angle + inside)
        back = (rs**2 + rp**2) / 2
        # The window is flat to y = 10; beyond, about (10, -8), is a bend of radii 6 and 8.
        met = -2 <= z <= 0 if abs(y) <= 10 else z > -8 and 6 <= math.hypot(abs(y) - 10, z + 8) <= 8
        assert ray[6] == pytest.approx(1 - back if met else 0.0, abs=1e-9)
        assert ray[7] == pytest.approx(back if met else 0.0, abs=1e-9)


def test_an_led_higher_than_the_window_misses_it_by_the_rest_of_its_height() -> None:
    row = EndRow("last", (0.0,), 1.0, size_mm=3.0, gap_mm=0.0)
    result = trace_light(bar(10.0, 2.0, 20.0, row), RAYS)
    assert result.value("missed_foot") == pytest.approx(1 / 3, abs=1e-3)
    assert result.ledger_gap() < 1e-12


def test_an_led_beside_the_guide_lights_nothing() -> None:
    scene = finger(3.0)
    row = EndRow("last", (40.0,), -1.0, gap_mm=0.0)
    result = trace_light(replace(scene, sources=(row,)), 1 << 10)
    assert result.value("missed_foot") == 1
    assert result.ledger_gap() == 0
    assert result.irradiance().max() == 0
    assert math.isnan(result.uniformity().cv)
    assert math.isnan(result.slope_sensitivity(axis="x").value)
    assert trace_paths(replace(scene, sources=(row,)), 8) == ()


GEL_PAD = GelSection(18.0, 2.0)
BENT = curved(CurvedGuide(20.0, 2.0, 3.0, 5.0), GEL_PAD)
CUT = mirror_profile(MirrorGuide(20.0, 2.0, 4.0), GEL_PAD)


def in_bent(y: Array, z: Array) -> NDArray[np.bool_]:
    """The right half of BENT: window, bend about (10, -5), leg."""
    radius = np.hypot(y - 10, z + 5)
    window = (y < 10) & (np.abs(z + 1) < 1)
    bend = (y >= 10) & (z >= -5) & (np.abs(radius - 4) < 1)
    return np.asarray(window | bend | ((np.abs(y - 14) < 1) & (z < -5) & (z > -10)))


def in_cut(y: Array, z: Array) -> NDArray[np.bool_]:
    """The right half of CUT above its leg: the mirror falls from (10, 0) to (12, -2)."""
    return np.asarray((np.abs(z + 1) < 1) & (y < 10 - z))


@pytest.mark.parametrize(
    ("profile", "inside", "y_mm", "z_mm"),
    [
        (BENT, in_bent, 12.5, -3.0),
        (BENT, in_bent, 10.3, -2.0),
        (BENT, in_bent, 14.6, -9.5),
        (CUT, in_cut, 10.5, -0.8),
    ],
    ids=["bend", "inner bend", "foot", "cut corner"],
)
def test_what_misses_a_bent_guide_is_the_part_of_the_led_outside_its_section(
    profile: GuideProfile,
    inside: Callable[[Array, Array], NDArray[np.bool_]],
    y_mm: float,
    z_mm: float,
) -> None:
    row = EndRow("first", (y_mm,), z_mm, gap_mm=0.0)
    scene = replace(finger(3.0), profile=profile, gel_x_mm=(-9.0, 9.0), sources=(row,))
    steps = (np.arange(400) + 0.5) / 200 - 1
    met = inside(*np.meshgrid(y_mm + steps, z_mm + steps))
    assert 0.05 < met.mean() < 0.95
    result = trace_light(scene, RAYS)
    assert result.value("missed_foot") == pytest.approx(1 - met.mean(), abs=2e-3)
    assert result.ledger_gap() < 1e-12
    assert result.value("lost") == 0


def test_a_point_is_in_a_region_with_arcs_holes_and_reversed_edges() -> None:
    """A pie of three quarters, a ring, and both with their edges turned round."""
    start = math.radians(30)
    arc = Arc((0.0, 0.0), 2.0, start, 1.5 * math.pi)
    pie = [Segment((0.0, 0.0), arc.start), arc, Segment(arc.end, (0.0, 0.0))]
    ring = [Arc((0.0, 0.0), 2.0, 0.0, 2 * math.pi), Arc((0.0, 0.0), 1.0, 1.0, -2 * math.pi)]
    y, z = np.random.default_rng(9).uniform(-2.5, 2.5, (2, 20_000))
    radius, angle = np.hypot(y, z), np.arctan2(z, y)
    in_pie = (radius < 2) & ((angle - start) % (2 * math.pi) < 1.5 * math.pi)
    in_ring = (radius < 2) & (radius > 1)
    for curves, expected in ((pie, in_pie), (ring, in_ring)):
        edges = [Edge(f"e{k}", curve, "acrylic", "air") for k, curve in enumerate(curves)]
        for given in (edges, [edge.reversed() for edge in edges]):
            assert np.array_equal(GuideProfile(tuple(given)).contains("acrylic", y, z), expected)
    moved = transformed(GuideProfile(tuple(edges)), 3.0, -1.0, 2.0, mirrored=True)
    assert np.array_equal(moved.contains("acrylic", 3 - 2 * y, 2 * z - 1), in_ring)
    assert not moved.contains("gel", y, z).any()


def test_three_lights_leave_the_figures_of_two_as_they_are() -> None:
    two = finger(3.0, absorption=0.0)
    row = EndRow("last", (-4.0, 4.0), -1.0, colour="blue", power=0.5)
    three = replace(two, sources=(*two.sources, row))
    one, other = trace_light(two, 1 << 14, seed=1), trace_light(three, 3 << 13, seed=1)
    sides = other.of_colours(("red", "green"))
    assert sides.colours == one.colours
    assert np.array_equal(sides.tallies, one.tallies)
    assert np.array_equal(sides.maps, one.maps)
    assert sides.shares == pytest.approx(one.shares)
    assert sides.rays == one.rays == 1 << 14
    assert other.shares == pytest.approx((0.4, 0.4, 0.2))
    assert {colour for colour, _ in trace_paths(three, 12)} == {"red", "green", "blue"}
    for missing in (("red", "white"), ()):
        with pytest.raises(KeyError, match="no light source"):
            other.of_colours(missing)


def test_blue_light_at_an_end_is_refracted_by_the_index_for_blue() -> None:
    row = EndRow("last", (0.0,), 1.0, gap_mm=0.0, colour="blue", law=Dome(30.0))
    points = np.random.default_rng(10).random((200, 4))
    widest = {}
    for blue in (None, 1.7):
        scene = bar(3.0, 2.0, 5.0, row)
        scene = replace(scene, media={**scene.media, "acrylic": Medium(1.49, blue_index=blue)})
        rays = launch(scene, row, points)
        widest[blue] = float(np.hypot(rays[:, 4], rays[:, 5]).max())
    assert widest[None] * 1.49 == pytest.approx(widest[1.7] * 1.7)


def test_rows_that_make_no_sense_are_refused() -> None:
    good = {"end": "last", "y_mm": (0.0,), "z_mm": -1.0}
    for change in (
        {"end": "tip"},
        {"y_mm": ()},
        {"y_mm": (math.nan,)},
        {"z_mm": math.inf},
        {"size_mm": 0.0},
        {"gap_mm": -0.1},
        {"power": 0.0},
        {"wavelength_um": 5.0},
    ):
        with pytest.raises(ValueError, match=r"must be|no LED"):
            EndRow(**{**good, **change})  # type: ignore[arg-type]
    scene = finger(3.0)
    for medium in ("glass", "paint", "air"):
        with pytest.raises(ValueError, match="end face"):
            launch_medium(scene, EndRow("last", (0.0,), -1.0, into=medium))
    with pytest.raises(ValueError, match="must meet air"):
        launch_medium(replace(scene, ends="mirror"), EndRow("last", (0.0,), -1.0))
    assert launch_medium(scene, EndRow("last", (0.0,), -1.0)) == "acrylic"


def brightest(result: LightResult) -> float:
    """x over half the pad's length where the mean across is largest."""
    profile = result.maps.mean(axis=(0, 1, 3))
    return float((np.argmax(profile) + 0.5) / len(profile) * 2 - 1)


def test_light_from_an_end_enters_the_gel_within_one_reach_of_its_edge() -> None:
    """Light below acos(n_gel/n) passes under the gel; the rest enters within 2 t cot of that."""
    scene = finger(3.0, pad_mm=60.0, absorption=0.0)
    row = EndRow("last", (0.0,), -1.0, size_mm=1.9, gap_mm=0.0)
    scene = replace(scene, sources=(row,))
    result = trace_light(scene, RAYS)
    least = math.acos(1.41 / N_ACRYLIC)
    reach = 2 * 2.0 / math.tan(least)
    assert brightest(result) > 0.6
    into_gel = result.entered_gel().value
    _, up, sine = disc()
    enters = (np.abs(up) > N_ACRYLIC * math.sin(least)) * (1 - fresnel(sine, N_ACRYLIC))
    # Light that goes round by a bend meets the gel at another angle.
    assert into_gel == pytest.approx(float(enters.mean()), rel=0.03)
    bins = result.maps.mean(axis=(0, 1)).sum(axis=1)
    assert bins[: int(len(bins) * (1 - 2 * reach / 60))].sum() < 0.2 * bins.sum()
