"""Bounds of the effects on the picture against the laws that they stand for."""

from __future__ import annotations

import math
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from effect_samples import (
    APART,
    BOUND,
    FIGURES,
    IS_NULL,
    MOTION,
    SCALE,
    ball,
    circumstances,
    same,
    values,
)
from PIL import Image
from scipy.optimize import minimize_scalar
from scipy.stats import rayleigh

from gelslim_twin.effects import dot_contrast, grey_values, image_noise
from gelslim_twin.effects.circumstances import MotionFigures
from gelslim_twin.effects.dot_contrast import (
    DefocusParameters,
    DrawingParameters,
    ExposureParameters,
)
from gelslim_twin.effects.dot_positions import MarkerPrintParameters, paraxial_px
from gelslim_twin.effects.effect import Bound, optics, picture
from gelslim_twin.effects.grey_values import (
    CompressionParameters,
    DirtParameters,
    ShadingParameters,
    SpecularParameters,
)
from gelslim_twin.effects.image_noise import SensorNoiseParameters

LENS = (("k1", -0.13), ("k2", 0.05), ("p1", 0.004), ("p2", -0.003), ("k3", -0.02))


def test_distortion_is_that_of_the_farthest_point() -> None:
    """Radial parts without their signs; the tangential part where it points outwards."""
    rho, given = (364.0 + paraxial_px(circumstances())) / 634.9, dict(LENS)
    radial = sum(abs(given[f"k{i}"]) * rho ** (2 * i + 1) for i in (1, 2, 3))
    angle = np.linspace(0, 2 * np.pi, 100_001)
    x, y, p1, p2 = rho * np.cos(angle), rho * np.sin(angle), given["p1"], given["p2"]
    across = np.hypot(
        2 * p1 * x * y + p2 * (rho**2 + 2 * x * x), p1 * (rho**2 + 2 * y * y) + 2 * p2 * x * y
    )
    c = circumstances(sensor=replace(FIGURES, lens_distortion=LENS))
    expected = optics(634.9 * (radial + float(across.max())))
    assert values(BOUND["lens_distortion"](c)) == pytest.approx(values(expected), rel=1e-8)
    assert not IS_NULL["lens_distortion"](c)
    plain = replace(FIGURES, lens_distortion=(("k1", 0.1),))
    same(BOUND["lens_distortion"](circumstances(sensor=plain)), optics(63.49 * rho**3))
    # A wide lens without coefficients draws angles.
    wide = replace(FIGURES, lens_distortion=(("k1", 0.0),), wide_lens=True)
    expected = optics(634.9 * (rho - np.arctan(rho)))
    same(BOUND["lens_distortion"](circumstances(sensor=wide)), expected)
    still = replace(FIGURES, lens_distortion=(("k1", 0.0), ("p2", 0.0)))
    assert IS_NULL["lens_distortion"](circumstances(sensor=still))
    assert BOUND["lens_distortion"](circumstances(sensor=still)) == Bound()


def test_layers_that_do_not_bend_rays_are_none() -> None:
    for layers, nil in (
        (((1.5, 1.0), (0.0, 1.4)), True),
        (((1.5, 1.0), (0.2, 1.4)), False),
        (((0.0, 1.0),), True),
        ((), True),
    ):
        c = circumstances(sensor=replace(FIGURES, layers_mm=layers))
        assert IS_NULL["refraction"](c) is nil
        assert (BOUND["refraction"](c).markers_px > 1e-9) is not nil


def test_the_farthest_of_all_dots_is_a_rare_one() -> None:
    """Rayleigh's quantile that one of 410 dots exceeds in a thousandth of the prints."""
    c = circumstances(marker_print=MarkerPrintParameters(jitter_mm=0.02))
    px = SCALE * float(rayleigh.isf(1e-3 / 410, scale=0.02))
    same(BOUND["marker_print"](c), optics(px))
    none = replace(c, sensor=replace(FIGURES, markers=0))
    one = replace(c, sensor=replace(FIGURES, markers=1))
    px = SCALE * float(rayleigh.isf(1e-3, scale=0.02))
    assert BOUND["marker_print"](none).markers_px == pytest.approx(px)
    assert BOUND["marker_print"](one).markers_px == pytest.approx(px)


@pytest.mark.parametrize(
    ("given", "markers_px", "image_px"),
    [
        ({}, 0.0, 0.0),
        ({"missing_percent": 0.3}, 1.1 * SCALE, 1.1 * SCALE),
        ({"odd_percent": 0.3}, 0.0, 0.15 * SCALE),
        ({"odd_percent": 3, "missing_percent": 3}, 1.1 * SCALE, 1.1 * SCALE),
    ],
)
def test_missing_and_odd_dots(given: dict[str, float], markers_px: float, image_px: float) -> None:
    c = circumstances(marker_print=MarkerPrintParameters(**given))
    same(BOUND["marker_print"](c), Bound(markers_px=markers_px, image_px=image_px))
    assert IS_NULL["marker_print"](c) is (not given)


@pytest.mark.parametrize("quality", [25, 40, 49, 50, 75, 90])
def test_jpeg_steps_are_those_of_the_encoder(quality: int) -> None:
    """Root mean square of the table that an encoder writes into its file."""
    stream = BytesIO()
    Image.new("L", (8, 8)).save(stream, "jpeg", quality=quality)
    steps = np.array(Image.open(BytesIO(stream.getvalue())).quantization[0], dtype=float)
    expected = math.sqrt(((steps**2).mean() + 1) / 12)
    assert grey_values.grey_levels(quality) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(("quality", "percent"), [(10, 500.0), (49, 5000 / 49), (50, 100.0),
                                                  (75, 50.0), (95, 10.0)])  # fmt: skip
def test_jpeg_quality_scales_the_table(quality: int, percent: float) -> None:
    rms = 67.1 * percent / 100
    assert grey_values.grey_levels(quality) == pytest.approx(math.sqrt((rms**2 + 1) / 12))


def toned_share(light: float, gamma: float) -> float:
    return min(1.0, light) ** (1 / gamma)


@pytest.mark.parametrize(("time", "gain", "gamma"), [(1.0, 1.0, 1.0), (1.3, 1.1, 0.7),
                                                     (0.5, 1.2, 2.2), (9.0, 2.0, 1.0)])  # fmt: skip
def test_grey_levels_are_worth_pixels_by_the_contrast_of_a_dot(
    time: float, gain: float, gamma: float
) -> None:
    """A dot in the least light, exposed and toned; saturated where both sides are white."""
    c = circumstances(
        drawing=DrawingParameters(level_dn=90.0, contrast=0.7),
        exposure=ExposureParameters(time=time, gain=gain, gamma=gamma),
        defocus=DefocusParameters(still_px=0.4),
        compression=CompressionParameters(quality=80),
    )
    bare = 0.35 * 90.0 / 255 * time * gain
    apart_dn = 255 * (toned_share(bare, gamma) - toned_share(0.3 * bare, gamma))
    edge_px = math.sqrt(1 + c.blur_px**2 + (4 * 0.4) ** 2)
    dot_px = 0.6 * SCALE
    assert dot_contrast.least_contrast_dn(c) == pytest.approx(apart_dn)
    assert dot_contrast.edge_px(c) == pytest.approx(edge_px)
    for grey_dn in (0.3, 2.0, 300.0):
        expected_px = min(dot_px, edge_px * grey_dn / apart_dn)
        assert dot_contrast.grey_shift_px(c, grey_dn) == pytest.approx(expected_px)
    for share in (0.01, 0.2, 5.0):
        expected_px = min(dot_px, edge_px * share / 0.7)
        assert dot_contrast.shift_px(c, share) == pytest.approx(expected_px)
    lost_dn = 3 * grey_values.grey_levels(80)
    same(BOUND["compression"](c), picture(min(dot_px, edge_px * lost_dn / apart_dn)))


def test_a_white_picture_shows_no_dots() -> None:
    c = circumstances(exposure=ExposureParameters(time=1000.0, gain=10.0))
    assert dot_contrast.least_contrast_dn(c) == 0
    assert dot_contrast.grey_shift_px(c, 1e-6) == 0.6 * SCALE
    pale = circumstances(drawing=DrawingParameters(level_dn=60.0, contrast=0.01))
    expected_px = dot_contrast.edge_px(pale) * 0.02 / (0.35 * 60.0 * 0.01)
    assert dot_contrast.grey_shift_px(pale, 0.02) == pytest.approx(expected_px)


def test_uncompressed_pictures_lose_nothing() -> None:
    assert BOUND["compression"](circumstances()) == Bound()
    assert IS_NULL["compression"](circumstances())
    c = circumstances(compression=CompressionParameters(quality=80))
    assert not IS_NULL["compression"](c)


@pytest.mark.parametrize("gamma", [0.4, 1.0, 2.2])
@pytest.mark.parametrize(("time", "gain"), [(1.0, 1.0), (0.9, 1.05), (2.0, 3.0)])
def test_exposure_changes_an_edge_by_gain_and_tone(time: float, gain: float, gamma: float) -> None:
    """The largest |v^(1/gamma) - v| is searched for; at most the whole edge is shifted."""
    least = minimize_scalar(
        lambda v: -abs(v ** (1 / gamma) - v), bounds=(0, 1), options={"xatol": 1e-9}
    )
    changed = abs(time * gain - 1) - float(least.fun)
    c = circumstances(exposure=ExposureParameters(time=time, gain=gain, gamma=gamma))
    edge_px = math.hypot(1.0, c.blur_px)
    noise_px = BOUND["sensor_noise"](c).image_px
    assert noise_px > 0
    same(BOUND["exposure"](c), picture(min(1.0, changed) * min(edge_px, 0.4 * edge_px + noise_px)))
    dirty = circumstances(
        exposure=ExposureParameters(time=time, gain=gain, gamma=gamma),
        dirt=DirtParameters(specks=1),
    )
    same(BOUND["exposure"](dirty), picture(edge_px * min(1.0, changed)))
    assert IS_NULL["exposure"](c) is (time == gain == gamma == 1)
    assert dot_contrast.toned(0.3, gamma) == pytest.approx(0.3 ** (1 / gamma))
    assert dot_contrast.toned(1.7, gamma) == 1


@pytest.mark.parametrize("read", [0.0, 5.0, 30.0])
def test_noise_is_that_of_electrons_in_three_channels(read: float) -> None:
    """Against draws of a pixel; gain amplifies light and noise alike."""
    c = circumstances(
        sensor_noise=SensorNoiseParameters(full_well_electrons=4000.0, read_noise_electrons=read),
        exposure=ExposureParameters(time=1.4, gain=3.0),
        drawing=DrawingParameters(level_dn=100.0, contrast=0.6),
    )
    electrons = 4000.0 * 0.35 * 100 / 255 * 1.4
    rng = np.random.default_rng(8)
    channels = rng.poisson(electrons / 3, (3, 200_000)) + read * rng.standard_normal((3, 200_000))
    drawn = channels.sum(axis=0).std() / electrons
    share = image_noise.sigma_share(c)
    assert share == pytest.approx(float(drawn), rel=0.01)
    assert share == pytest.approx(math.sqrt(1 / electrons + 3 * (read / electrons) ** 2))
    edge_px = math.hypot(1.0, c.blur_px)
    wide_px = edge_px * 3 * share / 0.6
    assert 0 < BOUND["sensor_noise"](c).image_px <= wide_px
    dirt = {**c.parameters, "dirt": DirtParameters(specks=1)}
    same(BOUND["sensor_noise"](replace(c, parameters=dirt)), picture(min(0.6 * SCALE, wide_px)))
    assert not IS_NULL["sensor_noise"](c)
    quiet = circumstances(sensor_noise=SensorNoiseParameters(full_well_electrons=0.0))
    assert image_noise.sigma_share(quiet) == 0
    assert IS_NULL["sensor_noise"](quiet)


def fallen_on(slope: float) -> float:
    """Change of the light on a surface of this slope, from a grazing beam, over the light."""
    beam = math.radians(18.9)
    turned = math.atan(slope)
    return max(
        abs(math.sin(beam + way * turned) / math.cos(turned) - math.sin(beam))
        for way in (-1.0, 1.0)
    ) / math.sin(beam)  # fmt: skip


@pytest.mark.parametrize(
    ("steepest", "depth_mm", "slope"),
    [(0.12, 0.1, 0.12), (9.0, 0.1, 0.1 / FIGURES.node_pitch_mm), (0.01, 0.1, 0.1 / 1.9)],
)
def test_shading_is_the_light_on_the_steepest_slope(
    steepest: float, depth_mm: float, slope: float
) -> None:
    """That of the tool, of a step from node to node, or at least the depth over the thickness."""
    c = circumstances(
        footprint=replace(ball(), steepest=lambda _d: steepest),
        motion=replace(MOTION, depth_mm=depth_mm),
        shading=ShadingParameters(ambient_share=0.35),
    )
    share = 0.65 * fallen_on(slope)
    assert grey_values.grey_share(c) == pytest.approx(share)
    same(BOUND["shading"](c), picture(min(0.6 * SCALE, share * dot_contrast.edge_px(c) / 0.8)))
    assert not IS_NULL["shading"](c)


def test_no_surface_is_brighter_than_one_that_faces_the_light() -> None:
    steep = replace(ball(), steepest=lambda _d: math.inf)
    c = circumstances(
        footprint=steep,
        motion=replace(MOTION, depth_mm=1.2),
        shading=ShadingParameters(ambient_share=0.2),
    )
    assert grey_values.grey_share(c) == pytest.approx(0.8 * (1 / math.sin(math.radians(18.9)) - 1))
    assert grey_values.grey_share(circumstances(motion=APART)) == 0
    dull = circumstances(shading=ShadingParameters(ambient_share=1.0))
    assert IS_NULL["shading"](dull)


@pytest.mark.parametrize(
    ("given", "wide_mm"),
    [({"specks": 2}, 0.3), ({"hairs": 2}, 0.06), ({"specks": 1, "hairs": 1}, 0.3), ({}, 0.0)],
)
@pytest.mark.parametrize("opacity", [0.0, 0.1, 1.0])
def test_dirt_hides_by_its_width_and_opacity(
    given: dict[str, int], wide_mm: float, opacity: float
) -> None:
    c = circumstances(
        dirt=DirtParameters(speck_mm=0.3, opacity=opacity, **given),
        drawing=DrawingParameters(contrast=0.25),
    )
    apart_px = (0.6 + wide_mm) / 2 * SCALE
    hidden_px = opacity / 0.25 * wide_mm * SCALE
    same(BOUND["dirt"](c), picture(2 / math.pi * min(hidden_px, apart_px)))
    assert IS_NULL["dirt"](c) is (not given or opacity == 0)


@pytest.mark.parametrize(("percent", "radius_px"), [(0.5, 4.0), (900.0, 0.4), (900.0, 50.0)])
def test_a_spot_adds_its_tint_up_to_its_width(percent: float, radius_px: float) -> None:
    """White in one channel and half of it in two, over the ink's contrast in the least light."""
    c = circumstances(
        specular=SpecularParameters(spots=1, brightness_percent=percent, radius_px=radius_px),
        drawing=DrawingParameters(level_dn=120.0, contrast=0.5),
    )
    added = percent / 100 * 255 * (1 + 0.5 + 0.5)
    shift_px = dot_contrast.edge_px(c) * added / (0.5 * 0.35 * 120)
    same(BOUND["specular"](c), picture(2 / math.pi * min(shift_px, 0.6 * SCALE, 3 * radius_px)))
    assert not IS_NULL["specular"](c)


def test_no_spots_or_black_ones_are_none() -> None:
    for given in ({"spots": 0}, {"spots": 3, "brightness_percent": 0}):
        c = circumstances(specular=SpecularParameters(**given))
        assert IS_NULL["specular"](c)
        assert BOUND["specular"](c) == Bound()


def test_forces_are_in_newtons_and_all_else_in_pixels() -> None:
    one, other = Bound(1.0, 7.0, 3.0, 9.0), Bound(5.0, 6.0, 7.0, 8.0)
    assert one.to_record() == {
        "displacement_px": 7.0, "force_n": 1.0, "markers_px": 3.0, "image_px": 9.0,
    }  # fmt: skip
    assert one.at_most(other) == other.at_most(one) == Bound(1.0, 6.0, 3.0, 8.0)


def test_effects_that_the_motion_makes_are_nil_at_rest() -> None:
    c = circumstances(motion=MotionFigures())
    assert IS_NULL["motion_blur"](c)
    assert IS_NULL["shading"](c)
    assert not IS_NULL["motion_blur"](circumstances())
    sharp = replace(FIGURES, aperture_mm=0.0)
    assert IS_NULL["defocus"](circumstances(sensor=sharp))
    assert not IS_NULL["defocus"](circumstances())
