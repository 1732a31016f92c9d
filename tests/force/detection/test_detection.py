"""Centres of drawn dots against their true centroids, with all that real frames do to them."""

from dataclasses import replace

import numpy as np
import pytest
from camera_rig import finger_view
from scipy.spatial import cKDTree
from synthetic import Look, grid_of_dots, render

from gelslim_force.detection.detection import Detector
from gelslim_force.detection.detections import BORDER, FAINT, LARGE, SMALL
from gelslim_force.detection.settings import DetectorSettings
from gelslim_optics.light.light_map import red_green_sides
from gelslim_twin.render.defocus import Defocus
from gelslim_twin.render.frame_renderer import FrameRenderer
from gelslim_twin.render.image_sensor import SensorNoise
from gelslim_twin.render.look import Look as RenderLook
from gelslim_twin.render.shading import Shading
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.render.surroundings import Pad
from ifem_export.markers.grid import build_marker_grid

GRID = grid_of_dots()
SEEDS = (1, 2, 3)


def detector_for(frame, double=False):
    extent = frame.diameter_px * (1.6 if double else 1.0)
    shape = "double" if double else "round"
    return Detector(DetectorSettings.for_diameters(extent, shape))


def compared(look):
    """Errors (k, 2) px of the drawn dots found, and how many were drawn, missed and made up."""
    errors, drawn, missed, spurious = [], 0, 0, 0
    for seed in SEEDS:
        frame = render(GRID, look=replace(look, seed=seed))
        found = detector_for(frame, look.double).detect(frame.image)
        there = frame.centres_px[frame.drawn]
        radius = frame.diameter_px[frame.drawn] / 2
        gap, dot = cKDTree(found.centres_px).query(there)
        hit = gap < radius
        errors.append((found.centres_px[dot] - there)[hit])
        drawn, missed = drawn + len(there), missed + int((~hit).sum())
        spurious += len(found) - len(np.unique(dot[hit]))
    return np.vstack(errors), drawn, missed, spurious


def rms(errors):
    return float(np.sqrt(np.mean(errors**2)))


@pytest.mark.parametrize(
    ("look", "limit_px"),
    [
        (Look(), 0.02),
        (Look(noise=8), 0.03),
        (Look(noise=8, blur=0), 0.03),
        (Look(noise=8, blur=2.0), 0.06),
        (Look(noise=8, gradient=0.8), 0.035),
        (Look(noise=8, colour=False), 0.045),
        (Look(noise=8, contrast=0.35), 0.055),
        (Look(noise=8, missing=0.5), 0.03),
        (Look(noise=8, double=True), 0.04),
        (Look(noise=8, missing=0.05, gradient=0.8, blur=1.5), 0.06),
    ],
    ids=["clean", "noise", "sharp", "blur", "light", "grey", "faint", "half", "double", "all"],
)
def test_centres_are_those_drawn(look, limit_px):
    """Asked for: 0.05 px RMS with noise of 8 grey levels, 0.09 with blur, 0.1 % spurious."""
    errors, drawn, missed, spurious = compared(look)
    assert rms(errors) < limit_px, rms(errors)
    assert np.abs(errors.mean(axis=0)).max() < 0.15 * limit_px, "no bias over the picture"
    assert missed == 0
    assert spurious == 0
    assert drawn >= 3 * 150


def test_specular_spots_and_dirt_cost_few_dots_and_add_none():
    errors, drawn, missed, spurious = compared(Look(noise=8, specular=8, dirt=20))
    assert spurious <= 0.001 * drawn
    assert missed <= 0.006 * drawn
    apart = np.hypot(*errors.T)
    assert np.percentile(apart, 95) < 0.09, "dots that dirt or glare touches apart"


def test_dots_in_a_shadow_are_found():
    """A dark wedge over a corner, its edge as dark against its surroundings as a dot."""
    frame = render(GRID, look=Look(noise=4))
    y, x = np.mgrid[:480, :640]
    shade = np.where(x + y < 380, 0.3, 1.0)[..., None]
    image = (frame.image * shade).astype(np.uint8)
    found = detector_for(frame).detect(image)
    gap, _ = cKDTree(found.centres_px).query(frame.centres_px)
    dark = frame.centres_px.sum(axis=1) < 380 - 15
    edge = np.abs(frame.centres_px.sum(axis=1) - 380) < 40
    assert dark.sum() > 40
    assert np.mean(gap[dark & ~edge] < 0.3) > 0.98
    assert np.mean(gap[~dark & ~edge] < 0.2) == 1.0
    assert np.mean(gap[edge] < 3) > 0.6


def test_dots_in_one_wide_dark_region_are_separated_at_a_higher_level():
    """A blot four pitches wide joins the dots; they are a little darker than it."""
    frame = render(GRID, look=Look(noise=2, contrast=0.6, gradient=0.2))
    y, x = np.mgrid[:480, :640]
    blot = 1 - 0.25 * np.exp(-(((x - 330) / 60) ** 4 + ((y - 230) / 60) ** 4))
    image = (frame.image * blot[..., None]).astype(np.uint8)
    found = detector_for(frame).detect(image)
    gap, _ = cKDTree(found.centres_px).query(frame.centres_px)
    assert np.sum(np.hypot(*(frame.centres_px - [330, 230]).T) < 55) > 10
    assert np.all(gap < 0.5)


@pytest.mark.parametrize(
    ("look", "limit_px"),
    [(Look(noise=8), 0.01), (Look(noise=8, blur=2.0), 0.04), (Look(noise=8, double=True), 0.01)],
)
def test_the_fast_path_gives_what_the_full_search_gives(look, limit_px):
    """From positions up to half a radius away, to less than the noise of the centres."""
    frame = render(GRID, look=look)
    detector = detector_for(frame, look.double)
    full = detector.detect(frame.image)
    rng = np.random.default_rng(3)
    turn = rng.uniform(0, 2 * np.pi, len(full))
    off = 0.5 * np.sqrt(full.area_px / np.pi) * rng.uniform(0, 1, len(full))
    near = full.centres_px + np.column_stack([off * np.cos(turn), off * np.sin(turn)])
    fast = detector.detect_near(frame.image, near, full.moments_px2)
    assert fast.found.all()
    apart = np.hypot(*(fast.centres_px - full.centres_px).T)
    assert np.percentile(apart, 99) < limit_px
    assert apart.max() < 5 * limit_px
    assert np.allclose(fast.area_px, full.area_px, rtol=0.1)


def test_the_fast_path_finds_nothing_where_there_is_nothing():
    frame = render(GRID, look=Look(noise=8, missing=0.2))
    detector = detector_for(frame)
    full = detector.detect(render(GRID, look=Look()).image)
    _, dot = cKDTree(full.centres_px).query(frame.centres_px)
    places = full.centres_px[dot].copy()
    moments = full.moments_px2[dot]
    fast = detector.detect_near(frame.image, places, moments)
    assert np.array_equal(fast.found, frame.drawn)
    outside = places.copy()
    outside[:5] = [[-3, 10], [700, 10], [20, 481], [np.nan, 3], [1e9, 1e9]]
    lost = detector.detect_near(frame.image, outside, moments)
    assert not lost.found[:5].any()
    assert np.array_equal(lost.found[5:], frame.drawn[5:])


def test_of_two_predictions_of_one_dot_the_nearer_has_it():
    frame = render(GRID, look=Look(noise=4))
    detector = detector_for(frame)
    full = detector.detect(frame.image)
    places = np.vstack([full.centres_px[50] + [1.5, 0], full.centres_px[50] + [0.2, 0]])
    fast = detector.detect_near(frame.image, places, full.moments_px2[[50, 50]])
    assert fast.found.tolist() == [False, True]


def test_doubtful_dots_are_flagged():
    frame = render(GRID, look=Look(noise=3))
    image = frame.image.astype(float)
    cx, cy = frame.centres_px[150]
    y, x = np.mgrid[:480, :640]
    near = np.hypot(x - cx, y - cy) < 9
    image[near] += 0.72 * (image[near].max(axis=0) - image[near])
    found = detector_for(frame).detect(image.astype(np.uint8))
    _, dot = cKDTree(found.centres_px).query(frame.centres_px)
    assert found.flags[dot[150]] & FAINT
    assert not found.trustworthy[dot[150]]
    large = GRID.kind == 1
    assert np.mean(found.flags[dot[large]] & LARGE > 0) == 1.0
    assert np.mean(found.flags[dot[~large]] & (LARGE | SMALL) > 0) < 0.01
    first = int(frame.centres_px[:, 0].min())
    cut = detector_for(frame).detect(np.ascontiguousarray(image.astype(np.uint8)[:, first:]))
    rim = np.flatnonzero(cut.flags & BORDER)
    assert len(rim) >= 1
    assert np.all(cut.centres_px[rim, 0] < 12)


def test_a_saturated_spot_hides_only_the_dots_in_it():
    frame = render(GRID, look=Look(noise=8))
    y, x = np.mgrid[:480, :640]
    image = frame.image.copy()
    image[np.hypot(x - 320, y - 240) < 40] = 255
    found = detector_for(frame).detect(image)
    gap, _ = cKDTree(found.centres_px).query(frame.centres_px)
    away = np.hypot(*(frame.centres_px - [320, 240]).T)
    assert np.all(gap[away < 30] > 3)
    assert np.all(gap[away > 60] < 0.4)
    reverse, _ = cKDTree(frame.centres_px).query(found.centres_px)
    assert np.mean(reverse > 4) < 0.005


@pytest.mark.parametrize("level", [0, 1, 128, 255])
def test_an_empty_picture_has_no_dots(level):
    assert len(Detector().detect(np.full((480, 640, 3), level, np.uint8))) == 0
    noise = np.random.default_rng(1).normal(level, 8, (480, 640))
    assert len(Detector().detect(np.clip(noise, 0, 255).astype(np.uint8))) <= 3


@pytest.mark.parametrize(
    ("image", "kind"),
    [
        (np.zeros((480, 640)), "uint8"),
        ([[1, 2], [3, 4]], "list"),
        (np.zeros((480, 640, 4), np.uint8), "480, 640, 4"),
        (np.zeros((480, 640, 2), np.uint8), "480, 640, 2"),
        (np.zeros((3, 480, 640, 3), np.uint8), "3, 480, 640, 3"),
        (np.zeros((8, 640), np.uint8), "640 x 8 px"),
        (np.zeros((0, 0), np.uint8), "0 x 0 px"),
    ],
)
def test_what_is_no_frame_is_refused(image, kind):
    with pytest.raises(ValueError, match=kind):
        Detector().detect(image)


def test_settings_that_find_nothing_are_refused():
    for bad, value in (
        ({"smallest_diameter_px": 0.5}, "0.5"),
        ({"smallest_diameter_px": 9, "largest_diameter_px": 8}, "from 9 to 8"),
        ({"least_contrast": 0.0}, "least_contrast = 0"),
        ({"shape": "square"}, "square"),
        ({"weight_from": 0.9, "weight_to": 0.5}, "from 0.9 to 0.5"),
    ):
        with pytest.raises(ValueError, match=value):
            DetectorSettings(**bad)
    with pytest.raises(ValueError, match="diameter"):
        DetectorSettings.for_diameters(np.array([np.nan]))


def test_a_view_of_an_array_gives_the_same_as_its_copy():
    frame = render(GRID, look=Look(noise=4))
    detector = detector_for(frame)
    whole = detector.detect(frame.image)
    view = np.asarray(frame.image[:, :, ::-1])[:, :, ::-1]
    assert not view.flags.c_contiguous or view.base is not None
    again = detector.detect(view)
    assert np.array_equal(whole.centres_px, again.centres_px)
    blue_first = detector.detect(np.ascontiguousarray(frame.image[:, :, ::-1]))
    assert np.allclose(whole.centres_px, blue_first.centres_px)


def test_the_dark_wedge_at_a_pads_corner_is_no_dot():
    """Where the pad's round corner meets the picture's border, a dark triangle is left; of 24
    frames with noise of 8 grey levels, 9 had a dot there once."""
    outline = Pad(22.0, 20.5, 1.0)
    look = RenderLook(
        shading=Shading(),
        defocus=Defocus(0.0, 22.0, 0.5),
        sensor_noise=SensorNoise(8.0, seed=20190521),
    )
    light = red_green_sides(22.0, 20.5, decay_mm=15.0, elevation_deg=25.0)
    grid = build_marker_grid(19, 18, 1.1, 0.45)
    draw = FrameRenderer(finger_view(), grid, light, outline, look)
    rest = SurfaceState.at_rest(22.0, 20.5)
    made_up = drawn = 0
    for number in range(24):
        frame = draw.frame(rest, number=number)
        there = frame.centres_px[frame.drawn]
        found = Detector(DetectorSettings.for_diameters(frame.diameter_px)).detect(frame.image)
        made_up += int((cKDTree(there).query(found.centres_px)[0] > 4).sum())
        drawn += len(there)
    assert made_up <= 1
