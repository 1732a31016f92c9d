"""Angular laws and launches against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from light_cases import N_ACRYLIC, finger

from gelslim_optics.light.launch import launch, point_batches
from gelslim_optics.light.scene import default_media
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
    [((0.0,), (1.0,)), ((5.0, 10.0), (1.0, 1.0)), ((0.0, 95.0), (1.0, 1.0)), ((0.0, 9.0), (0, 0))],
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
