"""Effects one by one: null means absent, seeds stand by themselves, bounds hold."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from render_rig import CAMERA, GRID, coarse, dent, detected_error, light, moved, renderer, rms
from scipy.ndimage import gaussian_filter

from gelslim_optics.camera.view_quality import blur_map
from gelslim_twin.render.blemishes import Dirt, Specular
from gelslim_twin.render.defocus import BlurField, Defocus, kernel_taps
from gelslim_twin.render.image_sensor import Compression, Exposure, MotionBlur, SensorNoise
from gelslim_twin.render.look import Look
from gelslim_twin.render.print_faults import MarkerPrint
from gelslim_twin.render.printed_dots import PrintedDots
from gelslim_twin.render.random_stream import stream, stream_key
from gelslim_twin.render.shading import Shading

ROOT = Path(__file__).parents[3]
FOLDERS = [str(ROOT / "tests" / "twin"), str(Path(__file__).parent)]
NULL = {
    "shading": Shading(ambient_share=1.0),
    "defocus": Defocus(0.0, 30.0, 0.0),
    "motion_blur": MotionBlur(shutter_ms=0.0),
    "exposure": Exposure(1.0, 1.0, 1.0),
    "sensor_noise": SensorNoise(0.0),
    "marker_print": MarkerPrint(),
    "dirt": Dirt(),
    "specular": Specular(),
}
ACTIVE = {
    "shading": Shading(),
    "defocus": Defocus(1.24, 30.0, 0.3),
    "motion_blur": MotionBlur(),
    "exposure": Exposure(1.2, 1.5, 1.8),
    "sensor_noise": SensorNoise(1.5, 40.0),
    "marker_print": MarkerPrint(0.02, 5.0, 5.0),
    "dirt": Dirt(10, 4),
    "specular": Specular(8),
    "compression": Compression(80),
}


def picture(look: Look) -> np.ndarray:
    drawn = renderer(look, camera=coarse(CAMERA))
    return drawn.frame(dent(0.5), dent(0.5, 1.3, 2.1), number=3).image


@cache
def bare() -> np.ndarray:
    return picture(Look())


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(NULL))
def test_an_effect_at_null_is_the_effect_absent_bit_for_bit(name):
    assert np.array_equal(picture(Look(**{name: NULL[name]})), bare())


@pytest.mark.parametrize("name", sorted(ACTIVE))
def test_an_effect_shows_and_the_same_twice(name):
    look = Look(**{name: ACTIVE[name]})
    shown = picture(look)
    assert np.array_equal(shown, picture(look))
    assert not np.array_equal(shown, bare())


@pytest.mark.slow
def test_frames_are_the_same_bytes_in_a_fresh_process():
    code = (
        f"import sys; sys.path[:0] = {FOLDERS!r}\n"
        "import hashlib, test_render_effects as t\n"
        "look = t.Look(**{k: v for k, v in t.ACTIVE.items()})\n"
        "print(hashlib.sha256(t.picture(look).tobytes()).hexdigest())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert done.stdout.strip() == hashlib.sha256(picture(Look(**ACTIVE)).tobytes()).hexdigest()


@pytest.mark.slow
def test_effects_left_out_are_not_loaded():
    code = (
        f"import sys; sys.path[:0] = {FOLDERS!r}\n"
        "import render_rig as r\n"
        "from gelslim_twin.render.image_sensor import SensorNoise\n"
        "r.renderer(r.Look(sensor_noise=SensorNoise(1.0))).frame(r.dent(), r.dent(0.4))\n"
        "print(*(m.rpartition('.')[2] for m in sys.modules "
        "if m.startswith('gelslim_twin.render.')))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    loaded = set(done.stdout.split())
    assert {"frame_renderer", "image_sensor", "dot_kernel"} <= loaded
    assert not loaded & {"shading", "defocus", "blemishes"}


def test_noise_changes_no_other_random_stream():
    faults = {k: ACTIVE[k] for k in ("marker_print", "dirt", "specular")}
    quiet = renderer(Look(**faults))
    noisy = renderer(Look(**faults, sensor_noise=SensorNoise(3.0, 20.0)))
    assert np.array_equal(quiet.still, noisy.still)
    a, b = quiet.frame(), noisy.frame()
    assert np.array_equal(a.centres_px, b.centres_px)
    assert np.array_equal(a.drawn, b.drawn)
    difference = (b.image.astype(int) - a.image)[200:280, 260:380]
    alone = renderer(Look(sensor_noise=SensorNoise(3.0, 20.0)))
    bare = renderer(Look())
    there = (alone.frame().image.astype(int) - bare.frame().image)[200:280, 260:380]
    assert np.corrcoef(difference.ravel(), there.ravel())[0, 1] > 0.8


def test_noise_has_the_stated_variance_and_no_pattern():
    values = np.repeat(np.array([0.0, 40.0, 160.0], np.float32), 100_000 * 3)
    image = values.reshape(3, 100_000, 3).copy()
    SensorNoise(2.0, 10.0, seed=5).apply(image, gain=2.0, frame=1)
    noise = image - values.reshape(image.shape)
    for row, value in zip(noise, (0.0, 40.0, 160.0), strict=True):
        assert row.mean() == pytest.approx(0, abs=5 * row.std() / np.sqrt(row.size))
        assert row.var() == pytest.approx((2 * 2) ** 2 + 2 * value / 10, rel=0.01)
        standard = row / row.std()
        assert (standard**3).mean() == pytest.approx(0, abs=0.03)
        assert (standard**4).mean() == pytest.approx(3, abs=0.06)
    unit = noise[0] / noise[0].std()
    for a, b in ((unit[:-1, 0], unit[1:, 0]), (unit[:, 0], unit[:, 1]), (unit[:, 1], unit[:, 2])):
        assert abs(np.mean(a * b)) < 5 / np.sqrt(len(a))


def test_noise_of_frames_and_seeds_is_independent():
    noise = []
    for seed, frame in ((0, 0), (0, 1), (1, 0)):
        image = np.full((100, 100, 3), 50, np.float32)
        SensorNoise(2.0, seed=seed).apply(image, frame=frame)
        noise.append((image - 50).ravel() / 2)
    for a, b in ((0, 1), (0, 2), (1, 2)):
        assert abs(np.mean(noise[a] * noise[b])) < 5 / np.sqrt(30_000)


def test_streams_differ_by_seed_name_and_frame_and_refuse_negatives():
    keys = {int(stream_key(s, n, f)) for s in range(3) for n in ("a", "b") for f in range(3)}
    assert len(keys) == 18
    assert stream(1, "a").random() == stream(1, "a").random()
    with pytest.raises(ValueError, match="negative"):
        stream(-1, "a")


@pytest.mark.parametrize("sigma", [0.05, 0.3, 0.8, 2.5, 8.0])
def test_blur_kernels_have_unit_sum_and_the_asked_variance(sigma):
    taps, reach = kernel_taps(np.array([sigma, 0.0, 8.0]))
    steps = np.arange(taps.shape[1])
    assert taps[0, 0] + 2 * taps[0, 1:].sum() == pytest.approx(1)
    assert 2 * (taps[0] * steps**2).sum() == pytest.approx(sigma**2, rel=0.02)
    assert reach[1] == 0
    assert taps[1, 0] == 1


def test_blurring_dots_alone_is_blurring_the_whole_picture():
    """Where the light is smooth, dots blurred one by one stand for the picture blurred at once."""
    sharp = renderer(Look(contrast=0.8))
    ink = np.zeros((480, 640), np.float32)
    whole = sharp.values(ink)
    frame = renderer(Look(defocus=Defocus(0.0, 30.0, 1.5))).frame(dent(0.4))
    plain = renderer().frame(dent(0.4))
    reference = gaussian_filter(plain.image.astype(float), (1.5, 1.5, 0), truncate=5)
    on_pad = whole[..., 1] > 20
    on_pad[:12] = on_pad[-12:] = False
    apart = np.abs(frame.image - reference)[on_pad]
    assert apart.max() < 3.0
    assert apart.mean() < 0.4
    assert np.abs(plain.image - reference)[on_pad].max() > 20


def test_defocus_grows_away_from_the_focus_as_the_camera_says():
    x = np.linspace(-9, 9, 7)
    places = np.column_stack([x, np.full(7, 2.3), np.zeros(7)])
    focus = float(CAMERA.apparent_distances_mm(places[3:4]).mean())
    lens = Defocus(1.24, focus)
    field = BlurField.of(CAMERA, 1.24, focus, (22.0, 21.0))
    exact = blur_map(CAMERA, x, [2.3], 1.24, focus)[0] * 20 / 4
    assert lens.sigma_px(field, places, np.full(7, 20.0)) == pytest.approx(exact, abs=0.02)
    assert exact[0] > 0.4
    assert exact[6] > 0.4
    sunken = places - [0, 0, 0.8]
    deep = blur_map(CAMERA, x, [2.3], 1.24, focus, -0.8)[0] * 20 / 4
    assert lens.sigma_px(field, sunken, np.full(7, 20.0)) == pytest.approx(deep, abs=0.05)
    assert np.abs(deep - exact).max() > 0.05


def test_dots_smeared_by_motion_stand_in_the_middle_of_their_path():
    before, now = moved((0.0, -0.1, 0.0)), moved((0.0, 0.1, 0.0))
    look = Look(motion_blur=MotionBlur(), defocus=Defocus(0.0, 30.0, 0.7))
    frame, still = renderer(look).frame(now, before), renderer(look).frame(moved((0, 0, 0)))
    assert np.abs(frame.centres_px - still.centres_px).max() < 0.01
    path = np.abs(
        renderer(look).frame(now).centres_px - renderer(look).frame(before).centres_px
    ).max()
    assert path > 3
    assert rms(detected_error(frame, weight_from=0.0)) < 0.02
    half = replace(look, motion_blur=MotionBlur(shutter_ms=5.0))
    moved_on = renderer(half).frame(now, before, step_s=0.01).centres_px - still.centres_px
    assert np.abs(moved_on).max() == pytest.approx(path / 4, rel=0.05)


def test_exposure_scales_saturates_and_bends_the_curve():
    base, double = renderer(Look(level_dn=60)), renderer(Look(level_dn=60, exposure=Exposure(2.0)))
    a, b = base.frame().image[200:280, 300:340], double.frame().image[200:280, 300:340]
    assert np.abs(b.astype(int) - 2 * a.astype(int)).max() <= 1
    assert renderer(Look(exposure=Exposure(50.0))).frame().image.max() == 255
    blank = Look(level_dn=60, contrast=0.0)
    curved = renderer(replace(blank, exposure=Exposure(gamma=2.2))).frame().image
    share = renderer(blank).values(np.zeros((480, 640), np.float32)) / 255
    expected = 255 * share ** (1 / 2.2)
    assert np.abs(curved - expected)[expected > 60].max() <= 0.6


def test_print_faults_jitter_drop_and_deform():
    nominal = PrintedDots.nominal(GRID)
    faults = MarkerPrint(0.03, 10.0, 20.0, seed=6)
    faulty = faults.apply(nominal)
    assert (faulty.centres_mm - nominal.centres_mm).std() == pytest.approx(0.03, rel=0.1)
    assert 0.05 < 1 - faulty.present.mean() < 0.16
    odd = np.any(faulty.semi_axes_mm != nominal.semi_axes_mm, axis=1)
    assert 0.12 < odd.mean() < 0.28
    jitter_only = MarkerPrint(0.03, seed=6).apply(nominal)
    assert np.array_equal(jitter_only.centres_mm, faulty.centres_mm)
    frame = renderer(Look(marker_print=faults)).frame()
    assert frame.drawn.sum() <= faulty.present.sum()
    assert rms(detected_error(frame, weight_from=0.0)) < 0.02


def test_dirt_takes_light_from_as_much_area_as_stated():
    clean, dirty = renderer(), renderer(Look(dirt=Dirt(200, 0, 0.3, opacity=1.0, seed=1)))
    lost = 1 - (dirty.still / clean.still)[..., 0]
    area = float((lost * clean.sight.pixel_mm() ** 2).sum())
    # A speck's half-axes are uniform between a third and the whole: mean area π/4 s² (2/3)².
    assert area == pytest.approx(200 * np.pi / 4 * 0.3**2 * (2 / 3) ** 2, rel=0.15)
    hairy = 1 - (renderer(Look(dirt=Dirt(0, 30, opacity=1.0))).still / clean.still)[..., 0]
    assert 0 < hairy.mean() < 0.01
    assert hairy.max() > 0.3


def test_specular_spots_are_brighter_than_all_else():
    image = renderer(Look(specular=Specular(20, 157.0, seed=2))).frame().image
    assert image.max() == 255
    assert renderer().frame().image.max() < 255


def test_compression_errs_less_at_higher_quality():
    plain = renderer().frame().image.astype(float)
    errors = [
        np.abs(renderer(Look(compression=Compression(q))).frame().image - plain).mean()
        for q in (20, 60, 95)
    ]
    assert errors[0] > errors[1] > errors[2] > 0


def test_light_of_other_colours_gives_three_sources():
    two = light()
    three = replace(
        two,
        irradiance=np.concatenate([two.irradiance, 0 * two.irradiance[..., :1] + 0.5], axis=2),
        azimuth_deg=[90, -90, 180],
        elevation_deg=[25, 25, 25],
        colour=[*two.colour, [0.05, 0.1, 1.0]],
    )
    image = renderer(Look(shading=Shading()), light=three).frame(dent(0.4)).image
    assert image[240, 320, 2] > renderer().frame().image[240, 320, 2] + 20


def test_noise_of_strips_is_the_noise_of_the_picture():
    whole = np.full((30, 40, 3), 60, np.float32)
    strips = whole.copy()
    noise = SensorNoise(2.0, 30.0, seed=9)
    noise.apply(whole, frame=4)
    for top in (0, 11, 22):
        noise.apply(strips[top : top + 11], frame=4, first=top * 40)
    assert np.array_equal(whole, strips)
