"""Hidden looks of drawn sensors are found again, stored, and drawn with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from appearance_rig import (
    GAMMA,
    PRINT,
    VIEW,
    Hidden,
    design_light,
    plain_look,
    seen_at_rest,
)
from render_rig import PAD, dent

from gelslim_optics.light.light_map import LightMap
from gelslim_twin.appearance.calibrate_look import renderers
from gelslim_twin.appearance.channel_light import channel_light, light_terms, mixed_fans
from gelslim_twin.appearance.comparison import compare_press
from gelslim_twin.appearance.fit_look import FittedLook, fit_look
from gelslim_twin.appearance.similarity import similarity
from gelslim_twin.render.frame_renderer import FrameRenderer
from gelslim_twin.render.look import Look
from gelslim_twin.render.shading import Shading
from gelslim_twin.scene.built_look import LookError, look_record, read_look, write_look


@pytest.fixture(scope="module")
def fitted() -> FittedLook:
    """The look of the drawn sensor of `Hidden()`."""
    design = design_light()
    rest = seen_at_rest(Hidden().renderer(design).frame(), design)
    return fit_look(rest, gamma=GAMMA)


def check(hidden: Hidden, found: FittedLook) -> None:
    look = found.look
    np.testing.assert_allclose(look.contrast[:2], hidden.contrast, atol=0.04)
    assert look.blur_px == pytest.approx(hidden.blur_px, abs=0.1)
    for light in (20.0, 60.0):
        truth = np.sqrt(hidden.read_dn**2 + light / hidden.electrons_per_dn)
        seen = np.sqrt(look.read_dn**2 + light / look.electrons_per_dn)
        assert seen == pytest.approx(truth, rel=0.12)
    assert look.grain_px == pytest.approx(hidden.grain_px, abs=0.15)
    ends = light_terms(np.array([[0.8, 0.0], [-0.8, 0.0]])) @ look.light_terms[:2].T
    assert ends[0, 0] - ends[1, 0] == pytest.approx(1.6 * hidden.red_along, abs=0.05)
    assert ends[0, 1] - ends[1, 1] == pytest.approx(0.0, abs=0.05)


@pytest.mark.slow
def test_a_hidden_look_is_found(fitted: FittedLook) -> None:
    check(Hidden(), fitted)
    design = design_light()
    clean = Hidden().renderer(design, noise=False)
    rest = seen_at_rest(Hidden().renderer(design).frame(), design)
    noisy, plain = renderers(fitted.look, rest, PRINT)
    assert similarity(plain.frame().image, clean.frame().image) > 0.97
    press = dent(0.9)
    found = compare_press(
        "press", clean.frame(press).image, clean.frame().image,
        plain.frame(press).image, plain.frame().image,
    )  # fmt: skip
    assert 0.05 < found["changed_share"] < 0.6
    assert found["similarity_changed"] > 0.98
    assert found["similarity_changed_of_rest"] < found["similarity_changed"] - 0.05
    spread = noisy.frame().image.astype(float) - plain.frame().image
    assert spread.std() == pytest.approx(
        (Hidden().renderer(design).frame().image.astype(float) - clean.frame().image).std(), rel=0.1
    )


@pytest.mark.slow
def test_a_mono_camera_has_one_channel() -> None:
    design = replace(design_light(), colour=np.ones((2, 3)))
    mono = replace(Hidden(green_level=0.0).renderer(design), mono=True)
    rest = seen_at_rest(mono.frame(), design)
    found = fit_look(rest, gamma=GAMMA)
    assert found.look.bare.shape == rest.picture.shape == (240, 320)
    assert found.look.contrast == pytest.approx(Hidden().contrast, abs=0.04)
    _, plain = renderers(found.look, rest, PRINT)
    clean = replace(Hidden(green_level=0.0).renderer(design, noise=False), mono=True)
    assert plain.frame().image.ndim == 2
    assert similarity(plain.frame().image, clean.frame().image) > 0.97


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_random_hidden_looks_are_found(seed: int) -> None:
    rng = np.random.default_rng([7, seed])
    hidden = Hidden(
        contrast=rng.uniform(0.45, 0.9),
        blur_px=rng.uniform(0.6, 1.8),
        read_dn=rng.uniform(0.3, 1.5),
        electrons_per_dn=rng.uniform(20, 80),
        grain_px=(0.0, 0.6)[seed % 2],
        red_along=rng.uniform(-0.5, 0.5),
        green_level=rng.uniform(-0.4, 0.3),
    )
    design = design_light()
    check(hidden, fit_look(seen_at_rest(hidden.renderer(design, seed=seed).frame(), design)))


def test_a_look_is_the_same_after_writing_and_reading(fitted: FittedLook, tmp_path) -> None:
    write_look(fitted.look, tmp_path / "look.json")
    again = read_look(tmp_path / "look.json")
    assert look_record(again) == look_record(fitted.look)
    assert again.digest == fitted.look.digest
    assert replace(again, blur_px=again.blur_px + 0.1).digest != again.digest


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{}", "not gelslim-look/1"),
        ("[1]", "does not hold a JSON object"),
        ('{"format": "gelslim-look/1"}', "markers is missing"),
    ],
)
def test_other_files_are_refused(text: str, message: str, tmp_path) -> None:
    (tmp_path / "look.json").write_text(text, encoding="utf-8")
    with pytest.raises(LookError, match=message):
        read_look(tmp_path / "look.json")
    with pytest.raises(LookError, match="no such file"):
        read_look(tmp_path / "absent.json")


@pytest.mark.parametrize(
    "changed",
    [
        {"blur_px": -1.0},
        {"level_dn": 0.0},
        {"contrast": np.array([0.5, 0.5, 1.2])},
        {"light_terms": np.zeros((3, 9))},
        {"bare": np.zeros((8, 8), dtype=np.uint8)},
    ],
)
def test_impossible_looks_are_refused(fitted: FittedLook, changed: dict) -> None:
    with pytest.raises(ValueError, match="must"):
        replace(fitted.look, **changed)


@pytest.mark.parametrize("lamps", [1, 2, 3, 4])
def test_channels_are_lit_as_by_their_lamps(lamps: int) -> None:
    """Drawn by lamp and by channel, a dent changes each channel by the same factor."""
    rng = np.random.default_rng(lamps)
    x, y = (np.linspace(-size / 2, size / 2, 9) for size in (PAD.length_mm, PAD.width_mm))
    tilt = 1 + 0.3 * rng.uniform(-1, 1, lamps) * np.linspace(-1, 1, 9)[:, None, None]
    light = LightMap(
        x, y, np.broadcast_to(tilt, (9, 9, lamps)).copy(), 360 * rng.random(lamps),
        rng.uniform(25, 50, lamps), rng.uniform(0.05, 1.0, (lamps, 3)),
    )  # fmt: skip
    own = channel_light(plain_look(3), light, (PAD.length_mm, PAD.width_mm))
    ink = np.zeros((VIEW.image_height_px, VIEW.image_width_px), np.float32)
    looks = Look(level_dn=60.0, contrast=0.5, shading=Shading())
    changes = []
    for source in (light, own):
        drawn = FrameRenderer(VIEW, PRINT, source, PAD, looks)
        changes.append(drawn.values(ink, dent(1.2)) / drawn.values(ink))
    middle = (slice(30, -30), slice(40, -40))
    assert np.abs(changes[0][middle] - 1).max() > 0.15
    np.testing.assert_allclose(changes[1][middle], changes[0][middle], atol=0.02)


def test_the_gain_multiplies_the_change_of_light() -> None:
    light = design_light()
    single, double = (
        mixed_fans(light, 3, np.tile([gain, 0.0, 0, 0, 0, 0], (3, 1))) for gain in (1.0, 2.0)
    )
    slope = (0.05, -0.03)
    size = np.sqrt(1 + slope[0] ** 2 + slope[1] ** 2)
    np.testing.assert_allclose(
        double.gain(slope) * size - 1, 2 * (single.gain(slope) * size - 1), rtol=1e-6
    )
