"""Light, shading and still picture against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from render_rig import AXIS_X, AXIS_Y, CAMERA, PAD, coarse, dent, light, moved, renderer

from gelslim_optics.light.light_map import LED_COLOURS, LightMap, red_green_sides
from gelslim_twin.render.defocus import Defocus
from gelslim_twin.render.look import Look
from gelslim_twin.render.shading import Shading
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.render.surroundings import Pad, Sight, still_irradiance


def tilted(slope_x: float, slope_y: float) -> SurfaceState:
    x, y = np.meshgrid(AXIS_X, AXIS_Y)
    z = slope_x * x + slope_y * y
    return SurfaceState(AXIS_X, AXIS_Y, np.stack([0 * z, 0 * z, z], 2))


@pytest.mark.parametrize("step", [1, 7])
def test_points_on_a_pixels_ray_are_seen_at_that_pixel(step):
    sight = Sight.of(CAMERA, step)
    assert sight.rest_mm.shape[0] >= (480 - 1) / step + 1
    rng = np.random.default_rng(0)
    rows, columns = rng.integers(0, [[sight.rest_mm.shape[0]], [sight.rest_mm.shape[1]]], (2, 50))
    for z in (-1.2, -0.3, 0.0):
        points = sight.rest_mm[rows, columns] + z * sight.slope[rows, columns]
        seen = CAMERA.project(np.column_stack([points, np.full(50, z)]))
        assert np.abs(seen - np.column_stack([columns, rows]) * step).max() < 1e-8


def test_a_pixels_footprint_is_that_of_the_cameras_jacobian():
    sight = Sight.of(CAMERA)
    at = sight.rest_mm[240, 320]
    scale = np.linalg.det(CAMERA.jacobian([[*at, 0.0]])[0])
    assert sight.pixel_mm()[240, 320] == pytest.approx(abs(scale) ** -0.5, rel=1e-4)


def test_sides_decay_and_have_the_asked_mean():
    lit = red_green_sides(22, 21, decay_mm=10, red=0.5, green=1.5)
    assert np.trapezoid(lit.irradiance[:, 0, 0], lit.y_mm) / 21 == pytest.approx(0.5)
    assert np.trapezoid(lit.irradiance[:, 0, 1], lit.y_mm) / 21 == pytest.approx(1.5)
    ratio = lit.at(np.array(0.0), np.array(5.0))[0] / lit.at(np.array(0.0), np.array(-5.0))[0]
    assert ratio == pytest.approx(np.exp(-1), rel=2e-3)


def test_light_from_bins_keeps_place_and_mean():
    bins = np.zeros((2, 4, 6))
    bins[0, 3, 0], bins[1] = 24.0, 1.0
    lit = LightMap.from_bins(
        bins, 8.0, 12.0, azimuth_deg=[90, -90], elevation_deg=[25, 25], colour=LED_COLOURS
    )
    assert lit.x_mm == pytest.approx([-3, -1, 1, 3])
    assert lit.y_mm == pytest.approx([-5, -3, -1, 1, 3, 5])
    assert lit.irradiance.mean() == pytest.approx(1)
    brightest = np.unravel_index(lit.irradiance[..., 0].argmax(), (6, 4))
    assert brightest == (0, 3)
    smooth = LightMap.from_bins(
        bins, 8.0, 12.0, azimuth_deg=[90, -90], elevation_deg=[25, 25], colour=LED_COLOURS,
        smooth_mm=2.0,
    )  # fmt: skip
    assert smooth.irradiance.mean() == pytest.approx(1)
    assert smooth.irradiance.max() < lit.irradiance.max() / 2


@pytest.mark.parametrize("slope", [(0.0, 0.1), (0.15, 0.0), (-0.1, -0.2), (0.0, 0.7)])
def test_a_tilted_plane_is_as_bright_as_lambert_says(slope):
    shading = Shading(ambient_share=0.2, relief=False)
    gain = shading.gain(
        Sight.of(CAMERA, shading.pixel_step), tilted(*slope), light(elevation_deg=30)
    )
    normal = np.array([-slope[0], -slope[1], 1.0]) / np.sqrt(1 + slope[0] ** 2 + slope[1] ** 2)
    for k, side in enumerate((1.0, -1.0)):
        towards = np.array([0.0, side * np.cos(np.pi / 6), np.sin(np.pi / 6)])
        direct = max(float(normal @ towards), 0.0) / np.sin(np.pi / 6)
        assert gain[60, 80, k] == pytest.approx(0.2 + 0.8 * direct, abs=1e-5)
    if slope == (0.0, 0.7):
        assert gain[60, 80, 0] == pytest.approx(0.2, abs=1e-6)


def test_shading_is_seen_where_the_line_of_sight_meets_the_dent():
    """The darkest red lies on the far flank, projected through the camera at its depth."""
    shading, lit = Shading(pixel_step=1, relief=False), light()
    state = dent(0.6, 0.0, 0.0)
    gain = shading.gain(Sight.of(CAMERA, shading.pixel_step), state, lit)
    y, x = np.unravel_index(gain[..., 0].argmin(), gain.shape[:2])
    grid = np.stack(np.meshgrid(np.linspace(-6, 6, 481), np.linspace(-6, 6, 481)), 2)
    u = state.at(grid.reshape(-1, 2)).reshape(481, 481, 3)
    there = u + np.dstack([grid, np.zeros((481, 481))])
    tangent_x, tangent_y = np.gradient(there, axis=1), np.gradient(there, axis=0)
    normal = np.cross(tangent_x, tangent_y)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    darkest = np.unravel_index((normal @ lit.directions[0]).argmin(), (481, 481))
    seen = CAMERA.project(there[darkest][None])[0]
    assert seen == pytest.approx([x, y], abs=3.0)
    shift = CAMERA.project([[*there[darkest][:2], 0.0]])[0] - seen
    assert np.hypot(*shift) > 2.0


def test_coarse_lattice_of_shading_is_near_the_fine_one():
    lit, state = light(), dent(0.6)
    frames = {
        step: renderer(Look(shading=Shading(pixel_step=step)), light=lit).values(
            np.zeros((480, 640), np.float32), state
        )
        for step in (1, 4, 8)
    }
    worst = {k: np.abs(frames[k] - frames[1]).max() for k in (4, 8)}
    assert worst[4] < 1.5
    assert worst[4] < worst[8] < 6


def test_level_gel_is_not_shaded_bit_for_bit():
    plain = renderer().frame().image
    for state in (SurfaceState.at_rest(22, 21), moved((0.0, 0.0, 0.0))):
        assert np.array_equal(renderer(Look(shading=Shading())).frame(state).image, plain)
    shifted = moved((0.01, 0.0, 0.0))
    gain = Shading().gain(Sight.of(CAMERA, 4), shifted, light())
    assert np.array_equal(gain, np.ones_like(gain))
    shaded = renderer(Look(shading=Shading(ambient_share=1.0))).frame(dent()).image
    assert np.array_equal(shaded, renderer().frame(dent()).image)


def test_red_is_left_and_green_right_and_the_dent_shows_both_flanks():
    image = renderer().frame().image.astype(int)
    assert image[240, 120, 0] > 1.5 * image[240, 120, 1]
    assert image[240, 520, 1] > 1.5 * image[240, 520, 0]
    blank = Look(level_dn=130.0, shading=Shading(), contrast=0.0)
    change = renderer(blank).frame(dent(0.6, 0, 0)).image.astype(int)
    change -= renderer(blank).frame().image
    assert change[..., 0].min() < -20
    assert change[..., 0].max() > 20
    darkest = [np.unravel_index(change[..., c].argmin(), (480, 640))[1] for c in (0, 1)]
    brightest = [np.unravel_index(change[..., c].argmax(), (480, 640))[1] for c in (0, 1)]
    # From inside, the dent is a hill: the flank that faces the lamp is the bright one.
    assert brightest[0] < darkest[0]
    assert brightest[1] > darkest[1]


def test_pad_fills_its_outline_and_the_frame_beside_it_is_dark():
    sight = Sight.of(CAMERA)
    even = light(1e9)
    still = still_irradiance(CAMERA, sight, even, Pad(18.0, 16.0, 2.0, frame_level=0.0))[..., 0]
    area = float((still * sight.pixel_mm() ** 2).sum())
    assert area == pytest.approx(18 * 16 - (4 - np.pi) * 2**2, rel=2e-3)
    corners = CAMERA.project([[8.9, 7.9, 0], [8.9, 0.0, 0], [-8.9, 0, 0]])
    values = [still[round(v), round(u)] for u, v in corners]
    assert values == pytest.approx([0, 1, 1], abs=1e-6)


def test_distance_to_the_outline_of_a_round_pad():
    pad = Pad(10.0, 10.0, 5.0)
    at = np.random.default_rng(2).uniform(-9, 9, (200, 2))
    assert pad.beyond_mm(at[:, 0], at[:, 1]) == pytest.approx(np.hypot(*at.T) - 5)


def test_vignetting_is_the_fourth_power_of_the_cosine():
    sight, even = Sight.of(CAMERA), light(1e9)
    wide = Pad(60, 60, frame_level=0.0)
    full = still_irradiance(CAMERA, sight, even, Pad(60, 60, frame_level=0.0, vignetting=1.0))
    ratio = (full / still_irradiance(CAMERA, sight, even, wide))[0, 0, 0]
    angle = np.arctan(np.hypot(319.5, 239.5) / 640)
    assert ratio == pytest.approx(np.cos(angle) ** 4, rel=1e-5)


def test_mottle_has_the_asked_spread_and_leaves_the_mean():
    sight, even = Sight.of(CAMERA), light(1e9)
    patchy = Pad(22, 21, 1, mottle=0.08, seed=4)
    ratio = still_irradiance(CAMERA, sight, even, patchy) / still_irradiance(
        CAMERA, sight, even, PAD
    )
    inside = PAD.beyond_mm(sight.rest_mm[..., 0], sight.rest_mm[..., 1]) < -0.5
    assert ratio[inside].mean() == pytest.approx(1, abs=0.05)
    assert 0.04 < ratio[inside].std() < 0.12


def test_blur_of_the_still_picture_softens_the_pads_edge_only():
    sharp, soft = renderer(), renderer(Look(defocus=Defocus(0.0, 30.0, 2.0)))
    assert np.abs(soft.still - sharp.still)[200:280, 200:400].max() < 2e-3
    assert np.abs(soft.still - sharp.still).max() > 0.1


@pytest.mark.parametrize(
    "change",
    [
        {"elevation_deg": [0, 25]},
        {"irradiance": -np.ones((2, 2, 2))},
        {"irradiance": np.ones((2, 3, 2))},
        {"x_mm": [1.0, 0.0]},
    ],
)
def test_invalid_light_is_refused_with_the_field(change):
    values = {
        "x_mm": [0.0, 1.0], "y_mm": [0.0, 1.0], "irradiance": np.ones((2, 2, 2)),
        "azimuth_deg": [90, -90], "elevation_deg": [25, 25], "colour": LED_COLOURS,
    }  # fmt: skip
    with pytest.raises(ValueError, match=next(iter(change))):
        LightMap(**(values | change))


@pytest.mark.parametrize("lamps", [1, 2, 3, 4])
def test_the_light_of_any_number_of_lamps_adds_up(lamps):
    """A frame of all lamps is the sum of frames of single ones: light is linear in its sources."""
    rng = np.random.default_rng(lamps)
    x, y = (np.linspace(-size / 2, size / 2, 5) for size in (PAD.length_mm, PAD.width_mm))
    fields = {
        "irradiance": rng.uniform(0.3, 1.5, (5, 5, lamps)),
        "azimuth_deg": rng.uniform(-180, 180, lamps),
        "elevation_deg": rng.uniform(20, 60, lamps),
        "colour": rng.uniform(0.0, 0.4, (lamps, 3)),
    }
    ink = np.full((240, 320), 0.25, dtype=np.float32)
    look = Look(level_dn=60.0, contrast=0.5, shading=Shading())

    def values(*chosen):
        kept = list(chosen)
        part = {n: v[..., kept] if n == "irradiance" else v[kept] for n, v in fields.items()}
        small = renderer(look, camera=coarse(CAMERA), light=LightMap(x, y, **part))
        return small.values(ink, dent(0.8))

    whole = values(*range(lamps))
    apart = sum(values(k) for k in range(lamps))
    assert whole.std() > 1
    np.testing.assert_allclose(whole, apart, rtol=2e-5, atol=1e-3)
