"""How far dots are shifted where the light is even, against dots that are drawn and detected."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from agreement import Trial
from effect_samples import FIGURES, MOTION, ball, circumstances
from numpy.typing import NDArray
from random_contact_scenes import random_contact
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings
from gelslim_twin.effects.circumstances import LEAST_LIGHT, Circumstances, Probed
from gelslim_twin.effects.dot_contrast import (
    RIM_SAFETY,
    DefocusParameters,
    DrawingParameters,
    defocus_bound,
    edge_px,
    is_even,
    least_light_dn,
    rim_px,
)
from gelslim_twin.effects.grey_values import ONE_SIDE
from gelslim_twin.effects.image_noise import SensorNoiseParameters, sensor_noise_bound
from gelslim_twin.effects.relief import DirtParameters, grey_share
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.render.light_change import changed_share
from gelslim_twin.simulation.picture import Viewer

Array = NDArray[np.float64]
FINE = 6
"""Parts of a pixel along each axis in which discs are drawn."""


def discs(centres: Array, radius: float, sigma: float, size: int, slope: float = 0.0) -> Array:
    """A picture (size, size) of discs that take 0.8 of a light of 150 grey values and a gradient.

    The light changes by the share `slope` across a disc.
    """
    ink, half = np.zeros((size, size)), math.ceil(radius) + 1
    at = (np.arange((2 * half + 1) * FINE) + 0.5) / FINE - 0.5 - half
    for x, y in centres:
        i, j = round(x), round(y)
        inside = (at[:, None] - (y - j)) ** 2 + (at[None, :] - (x - i)) ** 2 < radius**2
        share = inside.reshape(2 * half + 1, FINE, 2 * half + 1, FINE).mean(axis=(1, 3))
        ink[j - half : j + half + 1, i - half : i + half + 1] += share
    ink = gaussian_filter(ink, sigma) if sigma else ink
    light = 150 * (1 + slope * (np.arange(size) / (2 * radius) - size / (4 * radius)) / 8)
    return np.asarray(light[None, :] * (1 - 0.8 * ink))


def lattice(size: int, pitch: float, rng: np.random.Generator) -> Array:
    """Centres (n, 2) about a pitch apart, at random places of a pixel."""
    x, y = np.meshgrid(*(2 * [np.arange(pitch, size - 0.9 * pitch, pitch)]))
    return np.column_stack([x.ravel(), y.ravel()]) + rng.uniform(-0.5, 0.5, (x.size, 2))


def found(values: Array, centres: Array, radius: float) -> Array:
    """The centres that the detector finds."""
    image = np.clip(np.rint(values), 0, 255).astype(np.uint8)
    dots = Detector(DetectorSettings.for_diameters(np.array([2 * radius]))).detect(image)
    apart, nearest = cKDTree(dots.centres_px).query(centres)
    assert apart.max() < 2.0
    return dots.centres_px[nearest]


def test_a_dot_moves_by_two_over_pi_of_one_half_of_its_rim() -> None:
    """The centroid of a polygon whose right half is moved outwards by a little."""
    angle = np.linspace(0, 2 * np.pi, 20_001)[:-1]
    delta = 1e-4
    radius = 1 + delta * (np.cos(angle) > 0)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    centre = ((x + np.roll(x, -1)) * cross).sum() / (3 * cross.sum())
    assert centre / delta == pytest.approx(ONE_SIDE, rel=1e-3)


@pytest.mark.parametrize(("radius", "sigma"), [(3.5, 0.6), (4.5, 0.7), (6.0, 1.4)])
@pytest.mark.parametrize("noise", [3.0, 8.0])
def test_noise_moves_a_dot_by_its_rim(radius: float, sigma: float, noise: float) -> None:
    """Standard deviation of the shift by white noise; the farthest dot is within the bound."""
    rng = np.random.default_rng(int(10 * radius + noise))
    size = 320
    centres = lattice(size, 3.6 * radius, rng)
    still = discs(centres, radius, sigma, size)
    seen = found(still, centres, radius)
    shifts = []
    for _ in range(3):
        noisy = still + noise * rng.standard_normal(still.shape)
        shifts.append(found(noisy, centres, radius) - seen)
    drawn = float(np.std(np.concatenate(shifts)))
    # A camera whose dots have this size and blur, without a blur of its own.
    sensor = replace(
        FIGURES, aperture_mm=0.0, marker_diameter_mm=2 * radius * FIGURES.far_mm / FIGURES.focal_px
    )
    c = circumstances(
        sensor=replace(sensor, markers=len(centres)),
        motion=replace(MOTION, poses=3),
        defocus=DefocusParameters(still_px=sigma),
        drawing=DrawingParameters(contrast=0.8),
    )
    assert is_even(c)
    farthest = max(float(np.linalg.norm(s, axis=1).max()) for s in shifts)
    bound = rim_px(c, noise / 150) / RIM_SAFETY
    rayleigh = math.sqrt(2 * math.log(3 * len(centres) / 1e-3))
    assert drawn <= bound / rayleigh <= 3 * drawn
    assert farthest <= bound <= 6 * farthest


@pytest.mark.parametrize("slope", [0.0, 0.3])
@pytest.mark.parametrize("radius", [3.5, 5.0])
def test_blur_that_is_alike_on_all_sides_hardly_moves_a_dot(radius: float, slope: float) -> None:
    """Blurred discs on light with and without a gradient, at many places of a pixel."""
    rng = np.random.default_rng(int(radius))
    size, sigma = 320, 0.8
    centres = lattice(size, 3.6 * radius, rng)
    sharp, blurred = (discs(centres, radius, s, size, slope) for s in (0.0, sigma))
    shift = found(sharp, centres, radius) - found(blurred, centres, radius)
    c = circumstances(
        sensor=replace(FIGURES, aperture_mm=0.0), defocus=DefocusParameters(still_px=sigma)
    )
    farthest = float(np.linalg.norm(shift, axis=1).max())
    assert 0 < farthest <= defocus_bound(c).image_px
    assert defocus_bound(c).image_px == pytest.approx(0.4 * sigma)


def test_light_is_even_but_beside_dark_dirt_and_the_shade_at_walls() -> None:
    walls = replace(ball(), steepest=lambda _depth: math.inf)

    def light(**given: float) -> Circumstances:
        return circumstances(
            footprint=walls, motion=replace(MOTION, depth_mm=given.get("depth", 0.1))
        )

    deep, shallow = light(depth=0.3), light(depth=0.01)
    assert grey_share(shallow) < 0.5 * 0.8 < grey_share(deep)
    assert is_even(shallow)
    assert not is_even(deep)
    assert is_even(circumstances(motion=replace(MOTION, depth_mm=0.3)))
    # What a probe has seen of the light counts where it is less.
    seen = replace(deep, probed=Probed(1.0, 1.0, 0.3, {}, light_share=0.39))
    assert grey_share(seen) == 0.39
    assert is_even(seen)
    more = replace(deep, probed=Probed(1.0, 1.0, 0.3, {}, light_share=9.0))
    assert grey_share(more) == grey_share(deep)
    for opacity, even in ((0.19, True), (0.21, False)):
        for given in ({"specks": 1}, {"hairs": 1}):
            dirt = DirtParameters(opacity=opacity, **given)
            assert is_even(circumstances(dirt=dirt)) is even
    assert is_even(circumstances(dirt=DirtParameters(opacity=1.0)))
    # Where the light is not even, no more of it is taken for granted than where it is unknown.
    bright = replace(FIGURES, least_light=1.2)
    dirt = DirtParameters(specks=1)
    assert least_light_dn(circumstances(sensor=bright)) == pytest.approx(1.2 * 80)
    assert least_light_dn(circumstances(sensor=bright, dirt=dirt)) == pytest.approx(0.35 * 80)


def test_noise_that_is_correlated_averages_over_fewer_pixels() -> None:
    free, grain = (
        circumstances(sensor_noise=SensorNoiseParameters(grain_px=g)) for g in (0.0, 0.5)
    )
    ratio = sensor_noise_bound(grain).image_px / sensor_noise_bound(free).image_px
    assert 1 < ratio <= math.sqrt(1 + math.pi) * (1 + 1e-12)
    assert edge_px(free) == edge_px(grain)


@pytest.mark.parametrize("seed", [2100, 2146, 2178])
def test_the_least_light_is_that_of_the_darkest_dot_in_the_picture(
    tmp_path: Path, seed: int
) -> None:
    """Against the light of the rendered gel at the pixels of the dots."""
    one = Trial.of(*random_contact(seed), tmp_path)
    least = bundle_figures(one.folder).least_light
    viewer = Viewer(one.sensor, one.full(), one.loaded.scene)
    sums = viewer.renderer.still @ viewer.renderer.light.colour.sum(axis=1)
    x, y = np.rint(viewer.rest_px).astype(int).T
    inside = (x >= 0) & (y >= 0) & (x < sums.shape[1]) & (y < sums.shape[0])
    darkest = float(np.quantile(sums[y[inside], x[inside]], 0.02))
    assert 0.5 * darkest <= least <= darkest
    assert least > LEAST_LIGHT


@pytest.mark.parametrize("seed", [2122, 2130])
def test_the_change_of_the_light_is_that_of_pictures(tmp_path: Path, seed: int) -> None:
    """Whole pictures without dots and noise, with and without shading; 2130 has no walls."""
    one = Trial.of(*random_contact(seed), tmp_path)
    c = one.asked.circumstances
    drawn = {"shading", "drawing", "perspective", "refraction", "normal_contact"}
    full = one.full()
    plan = replace(full, order=tuple(n for n in full.order if n in drawn))
    whole = one.carried_out(plan)
    at = int(np.argmax([np.abs(s.force_n).sum() for s in whole.states]))
    viewer = whole.viewer
    renderer = viewer.renderer
    bare = np.zeros(renderer.still.shape[:2], dtype=np.float32)
    surface = viewer.surface(whole.states[at])
    with_slopes, level = (renderer.values(bare, s).sum(axis=2) for s in (surface, None))
    lit = level > 0.05 * np.median(level)
    share = float((np.abs(with_slopes - level)[lit] / level[lit]).max())
    step = renderer.look.shading.pixel_step
    assert changed_share(renderer, surface, step) == pytest.approx(share, rel=0.05)
    # The bound takes the steepest slope for granted.
    assert share <= grey_share(c)
