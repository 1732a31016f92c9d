"""A camera that moved after the calibration: corrected, or refused, and never read as a force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from camera_rig import off_centre_view
from sensor_samples import NORMAL_N, SHEAR_N, frame, press, sensor_bundle, sensor_grid
from synthetic import Look, render

from gelslim_force.calibration.calibration import calibrate
from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.settings import PipelineSettings
from gelslim_force.tracking.drift_filter import DriftSettings, TareError

FORCE_N = np.array([*SHEAR_N, -NORMAL_N])


@pytest.fixture(scope="module")
def opened() -> ForcePipeline:
    """The frames are drawn on a linear gel."""
    built = calibrate(sensor_bundle(), frame(0.0).image)
    return ForcePipeline(sensor_bundle(), built, PipelineSettings(gel="linear"))


@pytest.fixture
def chain(opened: ForcePipeline) -> ForcePipeline:
    return opened.with_normal(None)


def picture(share: float, shift=(0.0, 0.0), scale: float = 1.0, seed: int = 5) -> np.ndarray:
    """The press at a share of its depth by a camera that is shifted or whose focus has changed."""
    camera = off_centre_view()
    x, y = camera.principal_offset_px
    moved = replace(
        camera,
        principal_offset_px=(x + shift[0], y + shift[1]),
        focal_px=scale * camera.focal_px,
    )
    look = Look(noise=2.0, seed=seed)
    return render(sensor_grid(), moved, look, share * press().markers_mm).image


def scores(chain: ForcePipeline, image: np.ndarray, share: float) -> tuple[np.ndarray, np.ndarray]:
    """Error of the force in N, and over its standard deviation."""
    result = chain.process(image, normal_mm=share * press().nodes_mm[:, 2])
    assert result.problems == ()
    off = result.wrench.force_n - share * FORCE_N
    return off, off / result.wrench.standard_deviation[:3]


@pytest.mark.parametrize(
    ("shift", "scale"), [((0.3, 0.0), 1.0), ((0.0, -0.3), 1.0), ((-0.2, 0.2), 1.002)]
)
def test_small_drift_is_no_force(chain: ForcePipeline, shift, scale: float) -> None:
    """Without the correction 0.3 px of creep reads as 0.19 N, 100 of its standard deviations."""
    off, score = scores(chain, picture(0.0, shift, scale), 0.0)
    assert np.abs(score).max() < 3
    assert np.abs(off).max() < 0.003
    settings = PipelineSettings(gel="linear", drift=DriftSettings(correct=False))
    blind = ForcePipeline(sensor_bundle(), chain.calibration, settings)
    result = blind.process(picture(0.0, shift, scale))
    assert np.abs(result.wrench.force_n[:2]).max() > 0.05
    assert (np.abs(result.wrench.force_n / result.wrench.standard_deviation[:3])[:2] < 3).all()


@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_a_press_keeps_its_shear(chain: ForcePipeline, share) -> None:
    """It loses less than a twentieth and 3 mN, to the correction and to all else.

    Without drift the correction takes hardly anything.
    """
    for shift, scale in (((0.0, 0.0), 1.0), ((0.3, 0.0), 1.0), ((-0.2, 0.2), 1.002)):
        chain.reset()
        off, score = scores(chain, picture(share, shift, scale), share)
        assert np.abs(score).max() < 3
        assert np.hypot(*off[:2]) < 0.05 * share * np.hypot(*SHEAR_N) + 0.003
        if shift == (0.0, 0.0):
            assert np.hypot(*off[:2]) < 0.002


def test_a_shear_of_the_whole_gel_is_no_drift_where_it_is_known_to_be_pressed(
    chain: ForcePipeline,
) -> None:
    """The markers alone could not tell it from a shifted camera."""
    pressed = np.full(len(chain.points_mm), -0.05)
    still, sheared = picture(0.0), picture(0.0, (0.3, 0.0))
    blind = chain.process(sheared).wrench.force_n
    assert np.hypot(*blind[:2]) < 0.003
    chain.reset()
    rest = chain.process(still, normal_mm=pressed).wrench.force_n
    found = chain.process(sheared, normal_mm=pressed).wrench.force_n
    layer = 0.147 / 2 / 1.3223 / 2.0 * np.prod([22.0, 20.5])
    motion_mm = 0.3 / np.median(np.abs(off_centre_view().jacobian(chain.points_mm)[:, 0, 1]))
    assert np.hypot(*(found - rest)[:2]) == pytest.approx(layer * motion_mm, rel=0.3)
    with pytest.raises(TareError, match="touches"):
        chain.tare(sheared)


def test_two_thirds_of_the_gel_are_no_drift_either_once_they_are_known_to_be_pressed(
    chain: ForcePipeline,
) -> None:
    """The markers alone take the two thirds for what stands still, and the rest for pushed back."""
    moved = np.zeros((len(sensor_grid()), 3))
    moved[:, 0] = np.where(sensor_grid().positions_mm[:, 0] < 3.5, 0.012, 0.0)
    sheared = render(sensor_grid(), off_centre_view(), Look(noise=2.0, seed=6), moved).image
    layer_n = 0.147 / 2 / 1.3223 / 2.0 * 20.5 * (11.0 + 3.5) * 0.012
    pressed = np.where(chain.points_mm[:, 0] < 3.5, -0.05, 0.0)
    rest = chain.process(picture(0.0), normal_mm=pressed).wrench.force_n
    found = chain.process(sheared, normal_mm=pressed).wrench.force_n
    assert (found - rest)[0] == pytest.approx(layer_n, rel=0.3)
    chain.reset()
    chain.process(picture(0.0))
    assert chain.process(sheared).wrench.force_n[0] < 0


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize(
    ("shift", "scale", "words"),
    [((0.0, 0.0), 1.01, "scaled by 1.01"), ((0.8, 0.0), 1.0, "shifted by 0.8 px")],
)
def test_large_drift_is_refused(chain: ForcePipeline, shift, scale, words, share) -> None:
    result = chain.process(picture(share, shift, scale), normal_mm=share * press().nodes_mm[:, 2])
    assert result.wrench is None
    assert result.field is None
    assert words in result.problems[-1]
    assert np.abs(scores(chain, picture(share), share)[1]).max() < 3


def moved_pictures(image: np.ndarray, pitch_px: float) -> dict[str, np.ndarray]:
    step = round(pitch_px)
    return {
        "turned by 180°": image[::-1, ::-1],
        "mirrored left to right": image[:, ::-1],
        "mirrored top to bottom": image[::-1],
        f"shifted by {step} px": np.roll(image, step, axis=1),
        f"shifted by {step} px ": np.roll(image, -step, axis=0),
    }


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize("running", [pytest.param(False, marks=pytest.mark.slow), True])
def test_a_turned_mirrored_or_shifted_picture_is_no_force(
    chain: ForcePipeline, share: float, running: bool
) -> None:
    """As the first picture and in the midst of upright ones; the next upright one is right."""
    pitch_px = float(np.median(chain.calibration.reference.pitch_px))
    w = share * press().nodes_mm[:, 2]
    still, upright = picture(0.0), picture(share)
    for words, image in moved_pictures(upright, pitch_px).items():
        chain.reset()
        if running:
            chain.process(still)
            chain.process(still)
        result = chain.process(np.ascontiguousarray(image), normal_mm=w)
        assert result.wrench is None, words
        assert any(words.strip() in problem for problem in result.problems), result.problems
        assert np.abs(scores(chain, upright, share)[1]).max() < 3


def test_a_tare_makes_a_moved_camera_the_rest(chain: ForcePipeline) -> None:
    moved = ((1.2, -0.5), 1.002)
    assert chain.process(picture(0.0, *moved)).wrench is None
    record = chain.tare(picture(0.0, *moved, seed=6), time_s=12.0)
    assert chain.rests == (record,)
    assert (record.time_s, record.automatic) == (12.0, False)
    assert record.scale == pytest.approx(1.002, abs=2e-5)
    assert record.residual_px < 0.05
    chain.reset()
    result = chain.process(picture(0.0, *moved, seed=8))
    assert result.index == 0
    assert result.extra["rests"] == [record.summary()]
    assert "rests" not in chain.process(picture(0.0, *moved, seed=9)).extra
    off, score = scores(chain, picture(1.0, *moved, seed=7), 1.0)
    assert np.hypot(*off[:2]) < 0.05 * np.hypot(*SHEAR_N)
    assert np.abs(score).max() < 3


def test_a_normal_source_decides_whether_a_frame_can_be_the_rest(opened: ForcePipeline) -> None:
    """What it saw in the frame before does not count, and the markers show no faint contact."""
    points = len(opened.points_mm)

    class Seeing:
        touched = True

        def look(self, image, markers_px):
            return "contact" if self.touched else None

        def motion(self, seen, lateral_mm=None):
            w = np.full(points, -0.05 if seen else 0.0)
            return NormalReading(w, 0 * w, w < 0)

    source = Seeing()
    chain = opened.with_normal(source)
    chain.process(picture(0.0))
    with pytest.raises(TareError, match="light"):
        chain.tare(picture(0.0))
    source.touched = False
    assert chain.tare(picture(0.0)) == chain.rests[0]


def test_no_tare_with_contact_or_without_markers(chain: ForcePipeline) -> None:
    upright = picture(0.0)
    for bad in (picture(0.3), upright[:, ::-1], np.zeros_like(upright), upright[:99]):
        with pytest.raises(TareError):
            chain.tare(np.ascontiguousarray(bad))
    assert chain.rests == ()
    assert np.abs(scores(chain, upright, 0.0)[1]).max() < 3
