"""Tracking in windows round predictions: when it is left, and what it must not lose or invent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from synthetic import Frame, Look, grid_of_dots, render
from tracker_samples import CAMERA, GRID, PITCH_MM, FullSearch, errors, frame_at, tracker_for

from gelslim_force.frames.read_only import read_only
from gelslim_force.tracking import matching
from gelslim_force.tracking.matching import match
from gelslim_force.tracking.matching_kernel import mutual
from gelslim_force.tracking.tracker import TrackedFrame, Tracker
from gelslim_force.tracking.tracks import MarkerStatus

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def rest() -> Frame:
    return render(GRID, CAMERA, Look(noise=5))


def slid(pitches: Array, seed: int = 2) -> Frame:
    """The whole print slides along x and y by some pitches."""
    moved = np.tile(np.asarray(pitches) * PITCH_MM, (len(GRID), 1))
    return render(GRID, CAMERA, Look(noise=5, seed=seed), moved)


def followed(tracker: Tracker, frame: Frame) -> TrackedFrame:
    """Track a frame; nothing may be taken for another marker."""
    tracked = tracker.update(frame.image)
    off, _ = errors(tracker, tracked, frame)
    assert off.max() < 0.6
    return tracked


def test_a_slide_with_growing_speed_leaves_the_windows_and_loses_nothing(rest: Frame) -> None:
    """Steps that change by up to 0.14 pitches are predicted; a stop from 0.38 is a jump."""
    tracker = tracker_for(rest)
    routes, x = [], 0.0
    for k, step in enumerate((0.0, 0.1, 0.24, 0.38, 0.0, 0.0)):
        x += step
        tracked = followed(tracker, slid([0.3 * x, -x], seed=k + 2))
        inside = tracker.reference.positions_px[:, 0] > 60
        assert tracked.tracks.tracked[inside].mean() > 0.95
        routes.append(tracked.route)
    assert routes == ["full", "near", "near", "near", "full", "near"]


def test_an_occluded_dot_is_predicted_and_taken_up_when_it_comes_back(rest: Frame) -> None:
    tracker = tracker_for(rest)
    hidden = 150
    index = int(np.flatnonzero(tracker.reference.markers == hidden)[0])
    for k in range(8):
        frame = frame_at(0.1 * k, seed=k + 2)
        image, place = frame.image.copy(), frame.centres_px[hidden]
        if 2 <= k < 6:
            x, y = np.rint(place).astype(int)
            image[y - 9 : y + 10, x - 9 : x + 10] = image[y - 11, x - 11]
        tracked = tracker.update(image)
        off, _ = errors(tracker, tracked, frame)
        assert off.max() < 0.6
        assert tracked.route == ("full" if k == 0 else "near")
        status = tracked.tracks.status[index]
        if 2 <= k < 6:
            assert status == MarkerStatus.PREDICTED
            assert np.hypot(*(tracked.tracks.positions_px[index] - place)) < 1.5
        else:
            assert status == MarkerStatus.TRACKED


def test_dots_that_grow_and_merge_under_a_press_are_never_exchanged(rest: Frame) -> None:
    """Two neighbours move together until their dots touch, and apart again."""
    tracker = tracker_for(rest)
    one = 150
    off = np.hypot(*(GRID.positions_mm - GRID.positions_mm[one]).T)
    other = int(np.argsort(off)[1])
    toward = GRID.positions_mm[other] - GRID.positions_mm[one]
    grown = replace(GRID, diameter_mm=GRID.diameter_mm * np.where(off < 2.5, 1.25, 1.0))
    for share in (0.0, 0.1, 0.2, 0.28, 0.34, 0.28, 0.2, 0.1, 0.0):
        moved = np.zeros((len(GRID), 2))
        moved[one], moved[other] = share * toward, -share * toward
        frame = render(grown if share else GRID, CAMERA, Look(noise=5, seed=4), moved)
        tracked = tracker.update(frame.image)
        away, markers = errors(tracker, tracked, frame)
        pair = np.isin(markers, (one, other))
        assert away[~pair].max() < 0.6
        assert (away[pair] < 2.5).all(), "half the distance of the two dots"
    assert tracked.tracks.coverage > 0.99
    assert away.max() < 0.6


def test_two_predictions_that_claim_one_dot_do_not_share_it(rest: Frame) -> None:
    """Every second dot of a row vanishes while the row moves half a pitch: windows meet."""
    tracker = tracker_for(rest)
    followed(tracker, rest)
    row = np.flatnonzero(GRID.row == GRID.row[150])
    gone = row[::2]
    moved = np.zeros((len(GRID), 2))
    moved[row, 1] = 0.3 * PITCH_MM
    kept = np.setdiff1d(np.arange(len(GRID)), gone)
    shown = replace(
        GRID,
        diameter_mm=np.where(np.isin(np.arange(len(GRID)), gone), 1e-3, GRID.diameter_mm),
    )
    tracked = tracker.update(render(shown, CAMERA, Look(noise=5), moved).image)
    dots = tracked.tracks.dots[tracked.tracks.tracked]
    assert len(np.unique(dots)) == len(dots)
    seen = tracker.reference.markers[tracked.tracks.tracked]
    assert not np.isin(seen, gone).any()
    assert np.isin(seen, kept).all()


def test_dirt_that_falls_on_the_gel_moves_no_marker(rest: Frame) -> None:
    tracker = tracker_for(rest)
    followed(tracker, rest)
    for seed in (3, 4, 5):
        frame = frame_at(0.2, dirt=25, seed=seed)
        tracked = tracker.update(frame.image)
        off, markers = errors(tracker, tracked, frame)
        gap = np.linalg.norm(frame.centres_px[markers][:, None] - frame.dirt_px, axis=2).min(axis=1)
        assert off[gap > 2.5 * frame.diameter_px[markers]].max() < 0.5
        assert np.mean(off > 0.5) < 0.02
        assert tracked.tracks.coverage > 0.96


@pytest.mark.parametrize("share", [0.3, 1.4])
def test_a_change_of_brightness_leaves_the_windows_where_they_are(
    rest: Frame, share: float
) -> None:
    bright, other = tracker_for(rest), tracker_for(rest)
    for tracker in (bright, other):
        followed(tracker, rest)
    image = render(GRID, CAMERA, Look(noise=0, light=120)).image
    scaled = np.clip(np.rint(image * share), 0, 255).astype(np.uint8)
    a, b = bright.update(image), other.update(scaled)
    assert (a.route, b.route) == ("near", "near")
    both = a.tracks.tracked & b.tracks.tracked
    assert both.mean() > 0.99
    apart = (a.tracks.positions_px - b.tracks.positions_px)[both]
    assert np.sqrt(np.mean(apart**2)) < 0.02


def test_frames_of_other_content_are_searched_whole_and_give_no_markers(rest: Frame) -> None:
    """A blurred random scene, another print, and darkness; then the gel again."""
    rng = np.random.default_rng(6)
    scene = gaussian_filter(rng.uniform(0, 255, (480, 640, 3)), (5, 5, 0)) * 4 - 380
    print_ = render(grid_of_dots("none"), CAMERA, Look(noise=5), np.full((len(GRID), 2), 0.55))
    for image in (np.clip(scene, 0, 255).astype(np.uint8), np.full((480, 640, 3), 3, np.uint8)):
        tracker = tracker_for(rest)
        followed(tracker, rest)
        tracked = tracker.update(image)
        assert tracked.route == "full"
        assert tracked.tracks.coverage < 0.1
        assert followed(tracker, rest).tracks.coverage > 0.99
    tracker = tracker_for(rest)
    followed(tracker, rest)
    assert tracker.update(print_.image).route != "near"


def test_the_whole_frame_is_searched_seldom_while_all_is_well(
    rest: Frame, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And as often as before where markers are missing."""
    monkeypatch.setattr("gelslim_force.tracking.tracker._FULL_EVERY", 3)
    monkeypatch.setattr("gelslim_force.tracking.tracker._GUARD_EVERY", 8)

    def searched(image: NDArray[np.uint8]) -> list[int]:
        tracker = tracker_for(rest)
        return [k for k in range(17) if tracker.update(image).route == "full"]

    assert searched(rest.image) == [0, 8, 16]
    missing = render(GRID, CAMERA, Look(noise=5, missing=0.05)).image
    assert searched(missing) == [0, 3, 6, 9, 12, 15]


@pytest.mark.slow
def test_fewer_than_one_frame_in_a_hundred_of_a_long_stream_is_searched_whole(rest: Frame) -> None:
    """Presses and releases of two pitches a second at 60 frames a second, each with other noise."""
    tracker = tracker_for(rest)
    images = [frame_at(0.5 - 0.5 * np.cos(2 * np.pi * k / 40), seed=k + 2).image for k in range(40)]
    routes = [tracker.update(images[k % 40]).route for k in range(2000)]
    assert 6 <= routes.count("full") <= 12
    assert routes.count("near") + routes.count("full") == 2000


def test_windows_and_full_search_follow_a_stream_alike(rest: Frame) -> None:
    """Centres within rounding, apart from a few windows that are rounded to another size."""
    near, full = tracker_for(rest), tracker_for(rest, FullSearch)
    apart, changed = [], 0
    for k in range(6):
        image = frame_at(0.15 * k, seed=k + 2, blur=0.8).image
        a, b = near.update(image).tracks, full.update(image).tracks
        changed += int((a.status != b.status).sum())
        both = a.tracked & b.tracked
        apart.append(np.hypot(*(a.positions_px - b.positions_px)[both].T))
    off = np.concatenate(apart)
    assert np.percentile(off, 98) < 1e-5
    assert off.max() < 0.03
    assert changed <= 2


def test_the_short_way_of_matching_gives_what_the_whole_way_gives(
    rest: Frame, monkeypatch: pytest.MonkeyPatch
) -> None:
    tracker = tracker_for(rest)
    reference = tracker.reference
    rng = np.random.default_rng(8)
    for noise in (0.05, 0.4):
        points = reference.positions_px + rng.normal(0, noise, (len(reference), 2))
        order = rng.permutation(len(points))
        short = match(reference, points[order])
        with monkeypatch.context() as patch:
            patch.setattr(matching, "_one_patch", lambda *_: False)
            whole = match(reference, points[order])
        for name in ("positions_px", "displacement_px", "status", "dots"):
            assert np.array_equal(getattr(short, name), getattr(whole, name)), name
        assert short.coverage == 1.0


def test_mutual_neighbours_are_those_of_all_distances() -> None:
    rng = np.random.default_rng(9)
    for markers, dots in ((60, 80), (80, 40), (5, 0), (1, 1)):
        expected = rng.uniform(-20, 120, (markers, 2))
        expected[::9] = np.nan
        expected[1::17] = 1e300
        points, pitch = rng.uniform(0, 100, (dots, 2)), rng.uniform(5, 25, markers)
        found = np.empty(markers, np.int64)
        mutual(read_only(expected), read_only(points), read_only(pitch), 0.45, found)
        truth = np.full(markers, -1)
        if dots:
            gaps = np.hypot(*np.clip(expected[:, None] - points, -1e6, 1e6).transpose(2, 0, 1))
            gaps = np.where(np.isfinite(gaps), gaps, 1e9)
            wanted = np.argmin(gaps, axis=1)
            least = gaps[np.arange(markers), wanted]
            for i in np.flatnonzero(least < 0.45 * pitch):
                rivals = np.flatnonzero((wanted == wanted[i]) & (least < 0.45 * pitch))
                if i == rivals[np.argmin(least[rivals])]:
                    truth[i] = wanted[i]
        assert np.array_equal(found, truth)
