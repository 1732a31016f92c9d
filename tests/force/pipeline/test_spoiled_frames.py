"""Pictures in which something is covered, torn or lit: no answer, or one that its deviation holds.

The pictures are those of `pressed_samples`: another renderer than the twin's, and tractions that
are given on a finer mesh.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from fault_frames import FAULTS, SKIN, black_side, grey
from lit_pipelines import opened
from numpy.typing import NDArray
from pressed_samples import calibration, pressed
from pressed_shapes import ball, pressed_shape
from scipy.ndimage import gaussian_filter
from shaded_frames import shaded
from spoiled_stream import least_press_n, widest_sigma_n

from gelslim_force.contact.shading_change import LostColourError, ShadingReference
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.motion.unseen_motion import UnseenMotion

pytest.importorskip("PIL")
MODES = ("unknown", "none", "sphere:6", "depth")
"""An object of unknown shape, tangential forces alone, a named ball, and the depth given."""
COVERING = ("black_side", "hand", "glare", "torn", "frozen_rows")
SPOILING = (*COVERING, "compressed", "other_scene", "even", "dirt", "noisy", "soft_glare")
BALL = (ball(6.0), 0.5, (1.0, -1.0), 0.0, 3)
Picture = NDArray[np.uint8]


@cache
def untouched(seed: int = 77) -> Picture:
    return shaded(camera=calibration().camera, seed=seed, noise=2.5).image


def second(mode: str, image: Picture) -> FrameResult:
    """The result of a frame after one of the untouched gel."""
    chain = opened(mode)
    chain.reset()
    chain.process(untouched())
    given = np.zeros(len(chain.points_mm)) if mode == "depth" else None
    return chain.process(image, normal_mm=given)


def scores(result: FrameResult, force_n: NDArray[np.float64]) -> NDArray[np.float64]:
    """Errors of the components that are known, in standard deviations; none without a force."""
    if result.wrench is None:
        return np.zeros(0)
    off = result.wrench.force_n - force_n
    known = np.isfinite(off)
    return np.abs(off[known] / np.maximum(result.wrench.standard_deviation[:3][known], 1e-9))


def require_no_force(result: FrameResult) -> None:
    """Of an untouched gel: none, or one that is small and whose deviation is."""
    assert (scores(result, np.zeros(3)) < 3).all()
    if result.wrench is not None:
        assert np.nanmax(np.abs(result.wrench.force_n), initial=0) < least_press_n()
        assert np.nanmax(result.wrench.standard_deviation[:3], initial=0) < widest_sigma_n()


def spoiled(name: str, image: Picture, seed: int) -> Picture:
    return FAULTS[name](image, np.random.default_rng([list(FAULTS).index(name), seed]))


def test_a_black_third_gives_no_force() -> None:
    """It read -94 N, and -48 N by light and markers."""
    rng = np.random.default_rng(0)
    for side in range(4):
        result = second("none", black_side(untouched(), rng, 1 / 3, side))
        assert result.wrench is None
        assert "sharp edge" in result.problems[-1]


@pytest.mark.parametrize("mode", ["none", "depth"])
@pytest.mark.parametrize("name", COVERING)
def test_an_untouched_gel_behind_a_fault_is_no_force(mode: str, name: str) -> None:
    for seed in range(3):
        require_no_force(second(mode, spoiled(name, untouched(), seed)))


def test_dots_that_a_soft_rim_cuts_are_not_used() -> None:
    """Two fingers over every other row of dots: the rows beside them read as 97 mN."""
    cover = np.zeros(untouched().shape[:2])
    for top, bottom in ((52, 102), (124, 176)):
        cover[top:bottom, 387:] = 1
    for blur_px in (4, 6, 8):
        soft = gaussian_filter(cover, blur_px)[..., None]
        seen = np.clip(untouched() * (1 - soft) + 1.15 * SKIN * soft, 0, 255)
        require_no_force(second("none", np.rint(seen).astype(np.uint8)))


@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", SPOILING)
def test_no_fault_of_the_picture_is_a_force(mode: str, name: str) -> None:
    for seed in range(12):
        require_no_force(second(mode, spoiled(name, untouched(), seed)))


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["unknown", "none"])
@pytest.mark.parametrize("name", SPOILING)
def test_a_press_behind_a_fault_is_right_or_not_told(mode: str, name: str) -> None:
    truth = pressed(32)
    for seed in range(8):
        result = second(mode, spoiled(name, truth.image, seed))
        assert (scores(result, truth.wrench[:3]) < 4).all(), (seed, result.problems)


@pytest.mark.slow
def test_the_next_frame_is_right_again() -> None:
    truth = pressed(13)
    for name in ("black_side", "torn", "frozen_rows", "even"):
        second("unknown", spoiled(name, truth.image, 1))
        for _ in range(2):
            result = opened("unknown").process(truth.image)
        assert result.normal_known, name
        assert (scores(result, truth.wrench[:3]) < 3.5).all(), name


@pytest.mark.parametrize("noise", [0.0, 3.0])
def test_a_grey_picture_shows_no_contact(noise: float) -> None:
    """Only where the reference has colour: a mono camera's pictures are grey as they should be."""
    coloured = untouched()
    light = ShadingReference(coloured, np.zeros((0, 2)), np.zeros(0), 4)
    pale = grey(coloured, np.random.default_rng(0))
    with pytest.raises(LostColourError, match="grey"):
        light.change(pale, None)
    mono = ShadingReference(pale, np.zeros((0, 2)), np.zeros(0), 4)
    assert np.isfinite(mono.change(pale, None).change).all()
    faint = np.random.default_rng(1).normal(0, noise, coloured.shape) + 0.2 * coloured
    faint += 0.8 * pale
    assert np.isfinite(light.change(faint.astype(np.uint8), None).change).all()


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["unknown", "sphere:6"])
def test_a_grey_picture_has_no_normal_force(mode: str) -> None:
    """A ball read as -0.07 N for -0.48, an unknown shape as +0.23 N for -0.41."""
    result = second(mode, grey(pressed_shape(*BALL).image, np.random.default_rng(0)))
    assert not result.normal_known
    assert any("grey" in problem for problem in result.problems)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["unknown", "sphere:6"])
@pytest.mark.parametrize("name", ["colours_apart", "light_uneven", "exposure"])
def test_lights_that_drift_apart_are_no_force(mode: str, name: str) -> None:
    truth = pressed_shape(*BALL)
    for seed in range(4):
        pressing = second(mode, spoiled(name, truth.image, seed))
        assert pressing.wrench is not None
        assert pressing.wrench.force_n[2] == pytest.approx(truth.wrench[2], rel=0.07)
        assert (scores(pressing, truth.wrench[:3]) < 3).all()
        require_no_force(second(mode, spoiled(name, untouched(), seed)))


def exposed(image: Picture, factor: float) -> Picture:
    return np.clip(np.rint(image * factor), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("factor", [0.6, 1.2, 1.4, 1.6])
def test_no_exposure_hides_the_gel_beside_the_dots(factor: float) -> None:
    """A picture brighter by a third lost half of its bins: those of dots counted as soiled."""
    markers_px = calibration().reference.positions_px
    radius_px = np.full(len(markers_px), 8.0)
    light = ShadingReference(untouched(), markers_px, radius_px, 4)
    plain = light.change(untouched(1), markers_px, radius_px)
    seen = light.change(exposed(untouched(1), factor), markers_px, radius_px)
    assert plain.valid.sum() > 5000
    assert (seen.valid != plain.valid).mean() < 0.001


@pytest.mark.slow
@pytest.mark.parametrize(
    ("radius_mm", "depth_mm", "place_mm"),
    [(6.0, 0.5, (1.0, -1.0)), (4.0, 0.35, (-3.0, 2.0)), (8.0, 0.3, (2.5, 3.0))],
)
def test_no_exposure_changes_the_force_of_a_named_ball(
    radius_mm: float, depth_mm: float, place_mm: tuple[float, float]
) -> None:
    truth = pressed_shape(ball(radius_mm), depth_mm, place_mm, 0.0, 3)
    named = f"sphere:{radius_mm:g}"
    forces = []
    for factor in (1.0, 0.6, 0.75, 0.9, 1.1, 1.25, 1.35, 1.45):
        result = second(named, exposed(truth.image, factor))
        assert result.wrench is not None
        assert (scores(result, truth.wrench[:3]) < 3).all()
        forces.append(result.wrench.force_n[2])
    assert forces == pytest.approx([truth.wrench[2]] * len(forces), rel=0.05)
    assert forces == pytest.approx([forces[0]] * len(forces), rel=0.025)


def gap(count: int) -> tuple[UnseenMotion, NDArray[np.bool_]]:
    """Markers on a pitch of 1 mm over a gel of 2 mm, and a square gap in their middle."""
    x, y = (v.ravel() for v in np.mgrid[0:15, 0:15].astype(float))
    places = np.column_stack([x, y])
    seen = (np.abs(places - 7) > (count - 1) / 2).any(axis=1)
    return UnseenMotion(places, places + 0.2, 2.0), seen


def test_the_motion_in_a_gap_keeps_within_what_is_seen() -> None:
    """A steep motion beside the gap is not carried on into it, and the deviation grows inwards."""
    unseen, seen = gap(5)
    motion = np.zeros((len(seen), 3))
    motion[:, 0] = 0.1 * np.exp(-unseen.places_mm[:, 0] / 4)
    given = motion.copy()
    given[~seen, :2] = np.nan
    filled = unseen.filled(given, seen, 0.001)
    assert np.isfinite(filled.motion_mm).all()
    assert np.abs(filled.motion_mm[~seen, 0]).max() < 0.1
    off = filled.motion_mm[filled.unseen, 0] - motion[filled.unseen, 0]
    sigma = np.sqrt(np.diag(filled.covariance_mm2))
    assert (np.abs(off) < 3 * sigma).all()
    away = np.abs(unseen.places_mm[filled.unseen] - 7).max(axis=1)
    assert sigma[away == 0] > 1.5 * sigma[away == 2].max()
    assert np.linalg.eigvalsh(filled.covariance_mm2).min() > -1e-9


def test_the_fill_is_that_of_a_gaussian_process() -> None:
    """Against the textbook's formulas with one marker seen beside one that is not."""
    unseen = UnseenMotion(np.array([[0.0, 0.0], [1.0, 0.0]]), np.zeros((1, 2)), 2.0)
    seen, noise = np.array([True, False]), 0.01
    filled = unseen.filled(np.array([[0.1, 0.0, 0.0], [np.nan] * 3]), seen, noise)
    size = 0.1**2 / 2 + (0.02 * 2.0) ** 2
    ratio = np.sqrt(3) / 2
    share = (1 + ratio) * np.exp(-ratio)
    weight = size * share / (size + noise**2)
    assert filled.motion_mm[1, 0] == pytest.approx(weight * 0.1, rel=1e-6)
    assert filled.covariance_mm2[0, 0] == pytest.approx(size * (1 - share * weight), rel=1e-6)


def test_a_wide_gap_gives_no_force_and_a_narrow_one_does() -> None:
    for count, refused in ((3, False), (5, True)):
        unseen, seen = gap(count)
        assert bool(unseen.problem(seen)) == refused
        assert (unseen.hidden_mm(seen) > 0).sum() == count**2


def test_gaps_far_apart_hide_depths_that_are_independent() -> None:
    """The sum of the depths is that of the formula, from the correlation of all pairs of nodes."""
    unseen, all_seen = gap(0)
    places, thickness_mm = unseen.places_mm, unseen.thickness_mm

    def hidden(*gaps: tuple[float, float]) -> float:
        lost = np.zeros(len(places), dtype=bool)
        for middle in gaps:
            lost |= np.abs(places - middle).max(axis=1) < 1.5
        ratio = np.sqrt(3) * np.hypot(*(places[lost, None] - places[lost]).transpose(2, 0, 1))
        ratio /= thickness_mm
        expected = 0.02 * thickness_mm * np.sqrt(((1 + ratio) * np.exp(-ratio)).sum())
        found = float(unseen.hidden_mm(~lost).sum())
        assert found == pytest.approx(expected)
        return found

    assert all_seen.all()
    assert not unseen.hidden_mm(all_seen).any()
    one = hidden((3, 3))
    assert hidden((3, 3), (11, 11)) == pytest.approx(np.sqrt(2) * one, rel=0.02)
    assert one > 0.5 * 9 * 0.02 * thickness_mm
