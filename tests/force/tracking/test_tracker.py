"""Streams of drawn frames followed with their truth: presses, blinks, shadows, slips."""

import numpy as np
import pytest
from synthetic import Look, render
from tracker_samples import (
    CAMERA,
    GRID,
    PITCH_MM,
    PLACE,
    FullSearch,
    errors,
    frame_at,
    tracker_for,
)

from gelslim_force.detection.detection import Detector
from gelslim_force.detection.detections import Detections
from gelslim_force.tracking.tracker import Tracker
from gelslim_force.tracking.tracks import MarkerStatus


@pytest.fixture(scope="module")
def rest():
    return render(GRID, CAMERA, Look(noise=5))


def test_a_press_is_followed_on_the_fast_path(rest):
    tracker = tracker_for(rest)
    routes = []
    for k in range(12):
        frame = frame_at(1.2 * np.sin(0.25 * k), seed=k + 2)
        tracked = tracker.update(frame.image)
        routes.append(tracked.route)
        off, _ = errors(tracker, tracked, frame)
        assert tracked.tracks.coverage > 0.99
        assert off.max() < 0.5
        assert np.sqrt(np.mean(off**2)) < 0.06
        assert not tracked.slipped
    assert routes[0] == "full"
    assert routes.count("near") >= 10


def test_the_fast_path_gives_what_the_full_search_gives(rest):
    fast, full = tracker_for(rest), tracker_for(rest, FullSearch)
    for k in range(5):
        image = frame_at(0.1 * k, seed=k + 2).image
        a, b = fast.update(image), full.update(image)
        both = a.tracks.tracked & b.tracks.tracked
        assert both.mean() > 0.99
        apart = np.hypot(*(a.tracks.positions_px - b.tracks.positions_px)[both].T)
        assert np.percentile(apart, 98) < 1e-5, "both converge to one centre"
        assert apart.max() < 0.03, "a few windows are rounded to another size"
    assert (a.route, b.route) == ("near", "full")


def test_nothing_moves_nothing_moves(rest):
    tracker = tracker_for(rest)
    for k in range(4):
        tracked = tracker.update(render(GRID, CAMERA, Look(noise=5, seed=50 + k)).image)
        assert np.isfinite(tracked.tracks.displacement_px).all()
        assert np.sqrt(np.mean(tracked.tracks.displacement_px**2)) < 0.05


def test_frames_dropped_during_a_press_lose_no_marker(rest):
    """From rest to more than a pitch at once, and back."""
    tracker = tracker_for(rest)
    for amount in (0.0, 0.1, 1.4, 0.0, 1.4, 0.7):
        frame = frame_at(amount)
        tracked = tracker.update(frame.image)
        off, _ = errors(tracker, tracked, frame)
        assert tracked.tracks.coverage > 0.98
        assert off.max() < 1.0


def test_a_saturated_spot_on_the_contact(rest):
    tracker = tracker_for(rest)
    y, x = np.mgrid[:480, :640]
    spot = CAMERA.project(np.array([[*PLACE, 0.0]]))[0]
    for k in range(4):
        frame = frame_at(0.2 * k)
        image = frame.image.copy()
        image[np.hypot(x - spot[0], y - spot[1]) < 35] = 255
        tracked = tracker.update(image)
        off, markers = errors(tracker, tracked, frame)
        hidden = np.hypot(*(frame.centres_px - spot).T) < 25
        assert not hidden[markers].any(), "no marker is seen where the picture is white"
        assert np.mean(off < 0.5) > 0.985
        known = tracked.tracks.known[np.isin(tracker.reference.markers, np.flatnonzero(hidden))]
        assert known.mean() > 0.5, "places follow from the neighbours"
        far = np.hypot(*(frame.centres_px - spot).T) > 60
        assert np.isin(np.flatnonzero(far), markers).mean() > 0.99


def test_a_corner_falls_into_shadow_and_comes_back(rest):
    tracker = tracker_for(rest)
    y, x = np.mgrid[:480, :640]
    shade = np.where(x + y < 330, 0.03, 1.0)[..., None]
    lit = None
    for k in range(6):
        frame = frame_at(0.3 + 0.05 * k, seed=k + 2)
        dark = 1 <= k <= 3
        image = (frame.image * shade).astype(np.uint8) if dark else frame.image
        tracked = tracker.update(image)
        off, markers = errors(tracker, tracked, frame)
        assert np.percentile(off, 99) < 0.5
        lit = frame.centres_px.sum(axis=1) > 350
        assert np.isin(np.flatnonzero(lit), markers).mean() > 0.98
        if not dark:
            assert tracked.tracks.coverage > 0.99


def test_half_of_the_markers_vanish_and_return(rest):
    tracker = tracker_for(rest)
    tracker.update(frame_at(0.2).image)
    for k in range(3):
        frame = frame_at(0.2 + 0.05 * k, missing=0.5, seed=k + 5)
        tracked = tracker.update(frame.image)
        off, markers = errors(tracker, tracked, frame)
        assert frame.drawn[markers].all()
        assert off.max() < 0.6
        assert tracked.tracks.tracked.sum() > 0.92 * frame.drawn.sum()
        assert tracked.tracks.coverage == pytest.approx(0.5, abs=0.08)
    whole = tracker.update(frame_at(0.4).image)
    assert whole.tracks.coverage > 0.99


def test_black_frames_white_frames_and_another_scene_are_survived(rest):
    tracker = tracker_for(rest)
    tracker.update(frame_at(0.3).image)
    noise = np.random.default_rng(1).integers(0, 255, (480, 640, 3), dtype=np.uint8)
    for image in (np.zeros_like(noise), np.full_like(noise, 255), noise):
        tracked = tracker.update(image)
        assert tracked.tracks.coverage < 0.05
        assert tracked.tracks.count(MarkerStatus.TRACKED) <= 15
    frame = frame_at(0.5)
    tracked = tracker.update(frame.image)
    off, _ = errors(tracker, tracked, frame)
    assert tracked.tracks.coverage > 0.99
    assert off.max() < 0.5


@pytest.mark.parametrize("step", [(1, 0), pytest.param((0, -1), marks=pytest.mark.slow)])
def test_the_anchors_show_a_shift_of_all_markers_by_a_pitch(rest, step, monkeypatch):
    """Between two frames the print moves by a pitch: nothing but the anchors looks different."""
    monkeypatch.setattr("gelslim_force.tracking.tracker._FULL_EVERY", 5)
    tracker = tracker_for(rest)
    tracker.update(rest.image)
    moved = np.tile(np.array(step) * PITCH_MM, (len(GRID), 1))
    for k in range(7):
        frame = render(GRID, CAMERA, Look(noise=5, seed=k + 3), moved)
        tracked = tracker.update(frame.image)
    off, markers = errors(tracker, tracked, frame)
    assert off.max() < 0.5, "set right within one full search"
    assert not tracked.slipped
    assert len(markers) > 0.93 * len(GRID)
    median = np.nanmedian(np.hypot(*tracked.tracks.displacement_px.T))
    assert median == pytest.approx(np.median(tracker.reference.pitch_px), rel=0.25)


@pytest.mark.parametrize("running", [False, True])
def test_a_turned_or_mirrored_picture_is_told(rest, running):
    """Rows mirrored by a tilted view fall on other rows, with dots of other sizes."""
    tracker = tracker_for(rest)
    image = frame_at(0.8, seed=4).image
    for turned, words in (
        (image[::-1, ::-1], "turned by 180°"),
        (image[:, ::-1], "mirrored left to right"),
        (image[::-1], "mirrored top to bottom"),
    ):
        tracker.reset()
        if running:
            tracker.update(rest.image)
            tracker.update(rest.image)
        tracked = tracker.update(np.ascontiguousarray(turned))
        assert tracked.slipped
        assert tracked.turn == words
        upright = tracker.update(image)
        assert not upright.slipped
        assert upright.tracks.coverage > 0.99


@pytest.mark.parametrize(
    "image",
    [np.zeros((480, 640, 3)), np.zeros((0, 640, 3), np.uint8), np.zeros((480, 640, 5), np.uint8),
     None],
)  # fmt: skip
def test_what_is_no_frame_is_refused_and_forgotten(rest, image):
    tracker = tracker_for(rest)
    tracker.update(rest.image)
    with pytest.raises(ValueError, match="frame"):
        tracker.update(image)
    assert tracker.update(rest.image).tracks.coverage > 0.99


def test_reset_forgets_all_motion(rest):
    tracker = tracker_for(rest)
    first = [tracker.update(frame_at(a).image).tracks for a in (0.3, 0.6)]
    tracker.reset()
    again = [tracker.update(frame_at(a).image).tracks for a in (0.3, 0.6)]
    for a, b in zip(first, again, strict=True):
        assert np.array_equal(a.positions_px, b.positions_px, equal_nan=True)


def test_a_long_stream_keeps_no_more_than_its_last_frame(rest):
    """State does not grow: what the tracker holds has the size of the reference."""
    tracker = tracker_for(rest)
    images = [frame_at(0.1 * k).image for k in range(3)]

    def held():
        return sum(v.nbytes for v in vars(tracker).values() if isinstance(v, np.ndarray))

    tracker.update(images[0])
    before = held()
    for k in range(60):
        tracker.update(images[k % 3])
    assert held() == before
    assert not any(isinstance(v, list | dict) and len(v) > 10 for v in vars(tracker).values())


def test_dots_are_checked(rest):
    tracker = tracker_for(rest)
    none = Detections(
        np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros((0, 3)), np.zeros(0, np.int64)
    )
    with pytest.raises(ValueError, match="0 reference dots"):
        Tracker(Detector(), tracker.reference, none)
