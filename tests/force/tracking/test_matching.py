"""Matching of dots to markers in one frame, against the truth and the nearest neighbour."""

import numpy as np
import pytest
from marked_motion import GRID, KINDS, PITCH_MM, REFERENCE, REST_PX, motion, seen_at, shot
from scipy.spatial import cKDTree

from gelslim_force.tracking.matching import match
from gelslim_force.tracking.tracks import MarkerStatus, Tracks

SHOTS = 12


def wrong(tracks, seen):
    """Markers given a dot that is not theirs."""
    at = np.flatnonzero(tracks.dots >= 0)
    return int((seen.marker[tracks.dots[at]] != at).sum())


def nearest(reference, dots_px):
    """The nearest dot of each marker, as in the paper; two markers may take the same one."""
    dots = cKDTree(dots_px).query(reference.positions_px)[1]
    moved = dots_px[dots] - reference.positions_px
    return Tracks(dots_px[dots], moved, np.full(len(reference), MarkerStatus.TRACKED), dots)


@pytest.fixture(scope="module")
def score():
    """Wrong and found shares by kind, peak and mode: SHOTS frames each."""
    kept = {}
    for kind in KINDS:
        for peak in (0.3, 0.8, 1.2, 1.5):
            rng = np.random.default_rng(7)
            counts = {"robust": np.zeros(3), "nearest": np.zeros(3)}
            for _ in range(SHOTS):
                seen = shot(rng, motion(rng, kind, peak))
                there = int((seen.marker >= 0).sum())
                for mode, total in counts.items():
                    found = match if mode == "robust" else nearest
                    tracks = found(REFERENCE, seen.dots_px)
                    bad = wrong(tracks, seen)
                    total += [bad, tracks.tracked.sum() - bad, there]
            for mode, total in counts.items():
                kept[kind, peak, mode] = total
    return kept


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_one_in_a_thousand_wrong_at_most_up_to_one_and_a_half_pitches(score, kind):
    """5 % of the markers missing, 1 % spurious dots, no prediction: the reference only."""
    total = sum(score[kind, peak, "robust"] for peak in (0.3, 0.8, 1.2, 1.5))
    assert total[0] <= 0.001 * total[2], f"{total[0]} of {total[2]} wrong"
    for peak in (0.3, 0.8, 1.2, 1.5):
        bad, right, there = score[kind, peak, "robust"]
        assert bad <= 0.002 * there, (peak, bad)
        assert right >= 0.998 * there, (peak, right / there)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_the_nearest_neighbour_fails_from_half_a_pitch_on(score, kind):
    for peak in (0.8, 1.2, 1.5):
        bad, _, there = score[kind, peak, "nearest"]
        assert bad > 0.08 * there, (peak, bad / there)
    bad, right, there = score[kind, 0.3, "nearest"]
    assert right >= 0.99 * there, "fine while markers move less than half a pitch"


def test_the_nearest_neighbour_takes_dots_twice():
    rng = np.random.default_rng(1)
    seen = shot(rng, 0.0, missing=0.2, spurious=0.0)
    tracks = nearest(REFERENCE, seen.dots_px)
    assert tracks.coverage == 1.0
    assert len(np.unique(tracks.dots)) < len(tracks)
    robust = match(REFERENCE, seen.dots_px)
    assert robust.count(MarkerStatus.TRACKED) == (seen.marker >= 0).sum()
    assert len(np.unique(robust.dots[robust.dots >= 0])) == robust.tracked.sum()


def test_nothing_moves_nothing_is_displaced():
    tracks = match(REFERENCE, REST_PX)
    assert tracks.tracked.all()
    assert np.array_equal(tracks.dots, np.arange(len(GRID)))
    assert np.abs(tracks.displacement_px).max() == 0


def test_half_of_the_markers_missing():
    rng = np.random.default_rng(3)
    for _ in range(5):
        seen = shot(rng, motion(rng, "shear", 0.4), missing=0.5)
        tracks = match(REFERENCE, seen.dots_px)
        there = (seen.marker >= 0).sum()
        assert wrong(tracks, seen) <= 1
        assert tracks.tracked.sum() >= 0.92 * there
        lost = ~tracks.tracked
        assert np.all(tracks.dots[lost] == -1)
        assert tracks.coverage == pytest.approx(tracks.tracked.mean())


def test_predicted_positions_of_missing_markers_are_near_the_truth():
    rng = np.random.default_rng(4)
    moved = motion(rng, "both", 0.5)
    seen = shot(rng, moved, missing=0.1, spurious=0.0)
    tracks = match(REFERENCE, seen.dots_px)
    predicted = tracks.status == MarkerStatus.PREDICTED
    assert predicted.sum() > 20
    off = (
        np.hypot(*(tracks.positions_px - seen_at(moved))[predicted].T)
        / REFERENCE.pitch_px[predicted]
    )
    assert np.median(off) < 0.03
    assert off.max() < 0.25
    known = np.isfinite(tracks.positions_px).all(axis=1)
    assert np.allclose(
        tracks.displacement_px[known], (tracks.positions_px - REST_PX)[known], atol=1e-12
    )


def test_a_dot_that_contradicts_its_neighbours_is_rejected():
    dots = REST_PX.copy()
    dots[150] += 0.3 * REFERENCE.pitch_px[150] * np.array([1.0, 0.0])
    tracks = match(REFERENCE, dots)
    assert tracks.status[150] == MarkerStatus.REJECTED
    assert np.hypot(*(tracks.positions_px[150] - REST_PX[150])) < 0.3
    assert tracks.tracked.sum() == len(GRID) - 1


def test_markers_at_the_steep_edge_of_a_contact_are_kept():
    """Pushed aside by a third of a pitch within one pitch, as real presses do."""
    place = GRID.positions_mm - [1.3, 0.4]
    far = np.hypot(*place.T)
    size = 0.38 * PITCH_MM * np.clip((3.0 - far) / PITCH_MM, 0, 1) * np.clip(far, 0, 1)
    moved = -size[:, None] * place / far[:, None]
    rng = np.random.default_rng(5)
    seen = shot(rng, moved, missing=0.0, spurious=0.0)
    tracks = match(REFERENCE, seen.dots_px)
    assert (size > 0.2).sum() >= 8
    assert wrong(tracks, seen) == 0
    assert tracks.tracked.mean() > 0.995


def test_prediction_carries_over_several_pitches():
    """The whole lattice three rows on: from its prediction at once, and from rest not wrongly."""
    shifted = np.tile([3 * PITCH_MM, 0.0], (len(GRID), 1))
    # No spurious dots: one in the position of a missing marker cannot be told from it.
    seen = shot(np.random.default_rng(6), shifted, missing=0.02, spurious=0.0)
    expected = seen_at(shifted) + 1.0
    tracks = match(REFERENCE, seen.dots_px, expected)
    assert wrong(tracks, seen) == 0
    assert tracks.tracked.sum() >= (seen.marker >= 0).sum() - 1


def test_whole_print_in_view_shows_a_shift_of_one_pitch():
    """All dots count: the shift that explains them all wins, without anchors."""
    for step in ([PITCH_MM, 0.0], [0.0, -PITCH_MM], [PITCH_MM, PITCH_MM]):
        seen = shot(np.random.default_rng(8), np.tile(step, (len(GRID), 1)), 0.03, 0.01)
        tracks = match(REFERENCE, seen.dots_px)
        assert wrong(tracks, seen) <= 1
        assert tracks.coverage > 0.95


@pytest.mark.parametrize("count", [0, 1, 5, 30])
def test_almost_no_dots(count):
    rng = np.random.default_rng(9)
    tracks = match(REFERENCE, rng.uniform(0, 400, (count, 2)))
    assert tracks.tracked.sum() <= 0.3 * count
    assert len(tracks) == len(GRID)
    assert tracks.count(MarkerStatus.LOST) + tracks.count(MarkerStatus.REJECTED) > 300


def test_a_blind_prediction_loses_its_markers_only():
    expected = REST_PX.copy()
    expected[:20] = np.nan
    tracks = match(REFERENCE, REST_PX, expected)
    assert tracks.tracked[20:].all()
    assert tracks.tracked[:20].all(), "found by growing from the others"


def test_what_cannot_be_matched_is_refused():
    with pytest.raises(ValueError, match=r"\(1, 2\)"):
        match(REFERENCE, np.array([[1.0, np.nan]]))
    with pytest.raises(ValueError, match=r"\(5, 2\)"):
        match(REFERENCE, REST_PX, REST_PX[:5])


def test_kernels_are_compiled_once_whoever_made_the_arrays():
    from gelslim_force.tracking import matching_kernel, steep_kernel

    kernels = [matching_kernel.mutual, matching_kernel.verify, matching_kernel.grow]
    kernels += [matching_kernel.patches, steep_kernel.match_by_elimination]
    seen = shot(np.random.default_rng(3), motion(np.random.default_rng(3), KINDS[0], 0.8))
    frozen, strided = seen.dots_px.copy(), np.repeat(seen.dots_px, 2, axis=0)[::2]
    frozen.setflags(write=False)
    found = [match(REFERENCE, points) for points in (seen.dots_px.copy(), frozen, strided)]
    found.append(match(REFERENCE, frozen, REST_PX.copy()))
    assert all(np.array_equal(found[0].dots, other.dots) for other in found)
    for kernel in kernels:
        assert len(kernel.signatures) == 1, kernel.py_func.__qualname__
