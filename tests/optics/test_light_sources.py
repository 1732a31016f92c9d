"""Angular laws and launches against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from light_cases import N_ACRYLIC, finger, transformed

from gelslim_optics.guide.shapes import CurvedGuide, GelSection, curved_profile
from gelslim_optics.light.launch import launch, launch_medium, point_batches
from gelslim_optics.light.scene import LightScene, default_media
from gelslim_optics.light.source import Dome, EdgeLaunch, Lambertian, LedRow, MeasuredLaw

U = (np.arange(100_000) + 0.5) / 100_000


def test_lambertian_moments() -> None:
    cosine = Lambertian().cosine(U)
    assert np.mean(cosine) == pytest.approx(2 / 3, abs=1e-6)
    assert np.mean(cosine**2) == pytest.approx(1 / 2, abs=1e-6)


def test_dome_of_90_degrees_is_lambertian_and_narrow_ones_end() -> None:
    assert np.allclose(Dome(90.0, 1.0).cosine(U), Lambertian().cosine(U), atol=1e-12)
    narrow = Dome(20.0, 3.0).cosine(U)
    assert narrow.min() >= math.cos(math.radians(20.0))
    # Mean cosine for intensity cos³ within 20°.
    c = math.cos(math.radians(20.0))
    assert np.mean(narrow) == pytest.approx((1 - c**5) / 5 / ((1 - c**4) / 4), abs=1e-7)


def test_a_measured_law_of_cosines_is_lambertian() -> None:
    angles = np.linspace(0, 90, 181)
    law = MeasuredLaw(tuple(angles), tuple(np.cos(np.radians(angles))))
    assert np.allclose(law.cosine(U), Lambertian().cosine(U), atol=2e-4)
    ring = MeasuredLaw((0.0, 30.0, 31.0, 40.0, 41.0), (0.0, 0.0, 1.0, 1.0, 0.0))
    angle = np.degrees(np.arccos(ring.cosine(U)))
    assert angle.min() > 29.9
    assert angle.max() < 41.1


@pytest.mark.parametrize(
    ("angles", "values"),
    [
        ((0.0,), (1.0,)),
        ((5.0, 10.0), (1.0, 1.0)),
        ((0.0, 95.0), (1.0, 1.0)),
        ((0.0, 9.0), (0, 0)),
        ((0.0, 9.0), (1.0, -0.5)),
        ((0.0, 9.0), (1.0, math.inf)),
        ((0.0, 9.0, 9.0), (1, 1, 1)),
        ((0.0, 9.0), (1.0, 1.0, 1.0)),
    ],
)
def test_bad_tables_are_refused(angles: tuple, values: tuple) -> None:
    with pytest.raises(ValueError, match=r"angle|intensity|intensities"):
        MeasuredLaw(angles, values)


def test_bad_sources_are_refused() -> None:
    with pytest.raises(ValueError, match="no LED"):
        LedRow("foot_left", ())
    with pytest.raises(ValueError, match="size_mm"):
        LedRow("foot_left", (0.0,), size_mm=0.0)
    with pytest.raises(ValueError, match="half_angle_deg"):
        Dome(0.0)
    with pytest.raises(ValueError, match="na"):
        EdgeLaunch("foot_left", na=-1.0)


def test_acrylic_has_its_published_index_at_the_colours_of_the_leds() -> None:
    """Sultanova, Kasarova and Nikolov (2009) measured PMMA from 0.437 to 1.052 µm."""
    acrylic = default_media()["acrylic"]
    found = [acrylic.index_for("white", wavelength) for wavelength in (0.525, 0.59, 0.625)]
    assert found == pytest.approx([1.494, 1.4906, 1.489], abs=6e-4)
    assert acrylic.index_for("white") == 1.4906


def test_pieces_of_a_batch_join_up_and_replicates_differ() -> None:
    for sampling in ("sobol", "random"):
        whole, split, other = (
            np.concatenate(
                list(point_batches(4096, b, seed=1, replicate=r, source=0, sampling=sampling))
            )
            for b, r in ((4096, 0), (512, 0), (4096, 1))
        )
        assert np.array_equal(whole, split)
        assert not np.array_equal(whole, other)
        assert whole.shape == (4096, 4)


@pytest.mark.parametrize("foot", ["foot_left", "foot_right"])
def test_an_offset_moves_the_leds_from_the_start_of_the_foot_to_its_end(foot: str) -> None:
    scene = finger(3.0)
    segment = scene.profile.edge(foot).curve
    along = np.subtract(segment.end, segment.start) / segment.length_mm
    middle = np.add(segment.start, segment.end) / 2
    points = np.random.default_rng(3).random((4096, 4))
    for offset in (-0.4, 0.0, 0.3):
        row = LedRow(foot, (1.5,), size_mm=1.0, gap_mm=0.0, offset_mm=offset)
        rays = launch(scene, row, points)
        place = (rays[:, 1:3] - middle) @ along
        assert place.min() == pytest.approx(offset - 0.5, abs=2e-3)
        assert place.max() == pytest.approx(offset + 0.5, abs=2e-3)
        assert rays[:, 0].mean() == pytest.approx(1.5, abs=0.02)


def test_light_crosses_the_gap_along_its_direction_and_refracts_at_the_foot() -> None:
    """A tiny LED: where a ray meets the foot, and its direction in the guide, follow from Snell."""
    scene, gap = finger(3.0), 0.7
    segment = scene.profile.edge("foot_right").curve
    along = np.subtract(segment.end, segment.start) / segment.length_mm
    middle = np.add(segment.start, segment.end) / 2
    row = LedRow("foot_right", (1.5,), size_mm=1e-9, gap_mm=gap)
    rays = launch(scene, row, np.random.default_rng(4).random((2000, 4)))
    sine = N_ACRYLIC * np.column_stack([rays[:, 3], rays[:, 4:6] @ along])
    cosine = np.sqrt(1 - (sine**2).sum(axis=1))
    met = np.column_stack([rays[:, 0] - 1.5, (rays[:, 1:3] - middle) @ along])
    steep = cosine > 0.05
    np.testing.assert_allclose(met[steep], (gap * sine / cosine[:, None])[steep], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(rays[:, 3:6], axis=1), 1, atol=1e-12)


def test_a_batch_that_does_not_divide_the_count_ends_with_the_rest() -> None:
    for sampling in ("sobol", "random"):
        pieces = list(point_batches(1000, 300, seed=1, replicate=0, source=0, sampling=sampling))
        assert [len(piece) for piece in pieces] == [300, 300, 300, 100]
        (whole,) = point_batches(1000, 4096, seed=1, replicate=0, source=0, sampling=sampling)
        assert np.array_equal(np.concatenate(pieces), whole)
        (other,) = point_batches(1000, 4096, seed=1, replicate=0, source=1, sampling=sampling)
        assert not np.array_equal(other, whole)


def test_sobol_points_fill_every_stratum_once_and_random_ones_do_not() -> None:
    for sampling, once in (("sobol", True), ("random", False)):
        (points,) = point_batches(512, 512, seed=1, replicate=0, source=0, sampling=sampling)
        strata = np.sort((512 * points).astype(int), axis=0)
        assert np.all(strata == np.arange(512)[:, None]) == once
        assert 0 <= points.min() <= points.max() < 1


def frame(scene: LightScene, edge: str, medium: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middle of an edge, its direction, and its normal into a medium; (y, z) each."""
    found = scene.profile.edge(edge)
    start, end = np.array(found.curve.start), np.array(found.curve.end)
    along = (end - start) / np.linalg.norm(end - start)
    left = np.array([-along[1], along[0]])
    return (start + end) / 2, along, left if found.left == medium else -left


def slanted(*, mirrored: bool) -> LightScene:
    """Feet that lean; mirrored, the edges have the acrylic on their right."""
    guide = CurvedGuide(20.0, 2.0, 6.0, 5.0, math.radians(65))
    profile = curved_profile(guide, GelSection(12.0, 2.0))
    moved = transformed(profile, 0.4, 1.1, mirrored=mirrored)
    return replace(finger(3.0, gel_part=0.6), profile=moved)


SCENES = {"plain": slanted(mirrored=False), "turned": slanted(mirrored=True)}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("gap_mm", [0.0, 0.6])
def test_each_ray_of_an_led_follows_its_four_numbers(name: str, gap_mm: float) -> None:
    """Place on the LED, cone of Lambert's law, way through the gap, Snell and Fresnel."""
    scene = SCENES[name]
    middle, along, inward = frame(scene, "foot_left", "acrylic")
    row = LedRow("foot_left", (-6.0, 1.0, 8.5), size_mm=1.7, gap_mm=gap_mm, offset_mm=0.3)
    points = np.random.default_rng(8).random((300, 4))
    rays = launch(scene, row, points)
    for (a, b, c, d), ray in zip(points, rays, strict=True):
        led = min(int(3 * a), 2)
        x = row.x_mm[led] + (3 * a - led - 0.5) * 1.7
        s = 0.3 + (b - 0.5) * 1.7
        angle, turn = math.acos(math.sqrt(1 - c)), 2 * math.pi * d
        x += gap_mm * math.tan(angle) * math.sin(turn)
        s += gap_mm * math.tan(angle) * math.cos(turn)
        inside = math.asin(math.sin(angle) / N_ACRYLIC)
        way = math.cos(inside) * inward + math.sin(inside) * math.cos(turn) * along
        np.testing.assert_allclose(ray[:3], [x, *(middle + s * along)], atol=1e-9)
        np.testing.assert_allclose(ray[3], math.sin(inside) * math.sin(turn), atol=1e-12)
        np.testing.assert_allclose(ray[4:6], way, atol=1e-12)
        met = abs(s) <= 1.0 and -10 <= x <= 10
        rs = math.sin(angle - inside) / math.sin(angle + inside)
        rp = math.tan(angle - inside) / math.tan(angle + inside)
        back = (rs**2 + rp**2) / 2
        assert ray[6] == pytest.approx(1 - back if met else 0.0, abs=1e-9)
        assert ray[7] == pytest.approx(back if met else 0.0, abs=1e-9)
    assert 0 < np.mean(rays[:, 6] == 0) < 0.6


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(
    ("edge", "medium", "x_mm"),
    [("foot_right", "acrylic", 10.0), ("gel_window", "gel", 6.0), ("gel_window", "acrylic", 10.0)],
)
@pytest.mark.parametrize("na", [None, 0.0, 0.7, 9.0])
def test_each_ray_from_an_edge_fills_the_cone(
    name: str, edge: str, medium: str, x_mm: float, na: float | None
) -> None:
    scene = SCENES[name]
    middle, along, inward = frame(scene, edge, medium)
    index = N_ACRYLIC if medium == "acrylic" else 1.41
    widest = 1.0 if na is None else min(na / index, 1.0)
    points = np.random.default_rng(9).random((50, 4))
    length = scene.profile.edge(edge).curve.length_mm
    for planar in (False, True):
        rays = launch(scene, EdgeLaunch(edge, into=medium, na=na, planar=planar), points)
        for (a, b, c, d), ray in zip(points, rays, strict=True):
            across, lengthwise = widest * (2 * c - 1), 0.0
            if not planar:
                across = widest * math.sqrt(c) * math.cos(2 * math.pi * d)
                lengthwise = widest * math.sqrt(c) * math.sin(2 * math.pi * d)
            deep = math.sqrt(max(1 - across**2 - lengthwise**2, 0.0))
            place = middle + (b - 0.5) * length * along
            np.testing.assert_allclose(ray[:3], [(2 * a - 1) * x_mm, *place], atol=1e-9)
            way = deep * inward + across * along
            np.testing.assert_allclose(ray[3:6], [lengthwise, *way], atol=1e-12)
            assert ray[6:].tolist() == [1.0, 0.0]


def test_rays_start_in_the_medium_that_an_edge_meets() -> None:
    scene = SCENES["turned"]
    assert launch_medium(scene, LedRow("foot_left", (0.0,))) == "acrylic"
    assert launch_medium(scene, EdgeLaunch("gel_window", into="gel")) == "gel"
    for source in (
        EdgeLaunch("foot_left", into="gel"),
        EdgeLaunch("gel_face", into="paint"),
        LedRow("gel_window", (0.0,)),
    ):
        with pytest.raises(ValueError, match="edge"):
            launch_medium(scene, source)


def test_numbers_of_sources_are_checked_at_their_limits() -> None:
    for change in ({"gap_mm": -0.1}, {"gap_mm": math.inf}, {"size_mm": math.nan}, {"power": 0.0}):
        with pytest.raises(ValueError, match="must be"):
            LedRow("foot_left", (0.0,), **change)
    for change in ({"power": math.inf}, {"wavelength_um": 0.29}, {"wavelength_um": 2.1}):
        with pytest.raises(ValueError, match="must be"):
            EdgeLaunch("foot_left", **change)
    for exponent in (-0.1, math.inf):
        with pytest.raises(ValueError, match="exponent"):
            Dome(30.0, exponent)
    with pytest.raises(ValueError, match="half_angle_deg"):
        Dome(90.5)
    assert LedRow("foot_left", (0.0,), gap_mm=0.0).gap_mm == 0
    assert EdgeLaunch("foot_left", na=0.0, wavelength_um=2.0).na == 0
    assert Dome(90.0, 0.0).cosine(np.array([0.25])) == pytest.approx(0.75)


def test_a_measured_law_is_linear_in_the_angle_between_its_samples() -> None:
    law = MeasuredLaw((0.0, 40.0, 70.0), (1.0, 0.6, 0.1))
    theta = np.radians(np.linspace(0, 70, 200_001))
    flux = np.interp(np.degrees(theta), law.angle_deg, law.intensity) * np.sin(theta)
    share = np.concatenate([[0], np.cumsum((flux[1:] + flux[:-1]) / 2)])
    expected = np.cos(np.interp(U[::100], share / share[-1], theta))
    np.testing.assert_allclose(law.cosine(U[::100]), expected, atol=1e-7)
