"""Drift of the marker picture is found where the gel is free, and limited."""

from __future__ import annotations

import numpy as np
import pytest
from sensor_samples import press, sensor_grid

from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking.drift import FarField, Similarity
from gelslim_force.tracking.drift_filter import DriftFilter, DriftSettings, TareError
from gelslim_force.tracking.drift_filter_kernel import combined, left_over, squared_sigmas
from gelslim_force.tracking.tracks import MarkerStatus, Tracks

PX_PER_MM = 20.0
NOISE_PX = 0.04


def lattice() -> ReferenceLattice:
    grid = sensor_grid()
    places = PX_PER_MM * grid.positions_mm + [320.0, 240.0]
    return ReferenceLattice(np.column_stack([grid.row, grid.column]), places, np.arange(len(grid)))


def moved(similarity: Similarity, share: float = 0.0, seed: int = 0) -> np.ndarray:
    """Motion in px by a drift, a share of the sample's press, and noise."""
    drift = FarField(lattice()).motion_px(similarity)
    load = share * PX_PER_MM * press().markers_mm[:, :2] if share else 0.0
    return drift + load + np.random.default_rng(seed).normal(0, NOISE_PX, drift.shape)


def tracks(motion: np.ndarray) -> Tracks:
    status = np.full(len(motion), int(MarkerStatus.TRACKED))
    return Tracks(lattice().positions_px + motion, motion, status, np.arange(len(motion)))


def test_the_motion_is_that_of_a_rotation_matrix() -> None:
    angle, scale, shift = np.radians(30), 1.1, np.array([0.4, -0.2])
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    places = lattice().positions_px
    middle = places.mean(axis=0)
    expected = middle + shift + (places - middle) @ turn.T - places
    similarity = Similarity(complex(*shift), scale * np.exp(1j * angle) - 1)
    field = FarField(lattice())
    assert field.motion_px(similarity) == pytest.approx(expected, abs=1e-9)
    assert field.without(places + expected, similarity) == pytest.approx(places, abs=1e-9)
    assert field.basis @ similarity.vector == pytest.approx(expected, abs=1e-9)
    assert (similarity.rotation_deg, similarity.scale) == pytest.approx((30, 1.1))
    after = Similarity(0.1 + 0.3j, 0.02 - 0.01j)
    rest = similarity.minus(after)
    again = rest.shift_px + (1 + rest.growth) * (after.shift_px + (1 + after.growth) * 7j)
    assert again == pytest.approx(similarity.shift_px + (1 + similarity.growth) * 7j)


@pytest.mark.parametrize("drift", [Similarity(), Similarity(0.3 - 0.4j, 0.002 + 0.001j)])
def test_a_fit_without_contact_is_that_of_least_squares(drift: Similarity) -> None:
    field, motion = FarField(lattice()), moved(drift)
    found = field.fitted(motion, np.ones(len(motion), bool), NOISE_PX, Similarity())
    plain = np.linalg.lstsq(field.basis.reshape(-1, 4), motion.ravel(), rcond=None)[0]
    assert found.untouched
    assert found.free.mean() > 0.98
    # The sigma of the shift is 0.04 px over the root of 342; scale and rotation have an arm.
    assert np.abs(found.similarity.vector - plain).max() < 1e-3
    assert np.abs(found.similarity.vector - drift.vector)[:2].max() < 4 * NOISE_PX / np.sqrt(342)
    solved = np.einsum("pni,ni->p", field.solution(found), motion)
    assert solved == pytest.approx(found.similarity.vector, abs=1e-12)
    assert found.residual_px == pytest.approx(NOISE_PX, rel=0.1)


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_a_press_hardly_shows_where_the_gel_is_free(share: float) -> None:
    drift = Similarity(0.25 + 0.1j, 0.001j)
    motion = moved(drift, share)
    found = FarField(lattice()).fitted(motion, np.ones(len(motion), bool), NOISE_PX, Similarity())
    off = found.similarity.vector - drift.vector
    plain = np.abs(motion.mean(axis=0) - [0.25, 0.1]).max()
    assert not found.untouched
    assert np.abs(off[:2]).max() < 0.02 < 0.1 * plain / share
    assert np.abs(off[:2]).max() < 4 * found.leak_px


def test_a_large_drift_is_found_and_too_few_free_markers_are_not_used() -> None:
    field, drift = FarField(lattice()), Similarity(9 - 14j, 0.05 + 0.1j)
    motion = moved(drift)
    seen = np.ones(len(motion), bool)
    found = field.fitted(motion, seen, NOISE_PX, Similarity())
    assert np.abs(found.similarity.vector - drift.vector).max() < 0.02
    assert field.fitted(motion, seen & (np.arange(len(motion)) < 15), NOISE_PX, drift) is None
    everywhere = np.random.default_rng(3).normal(0, 5, motion.shape)
    assert field.fitted(everywhere, seen, NOISE_PX, Similarity()) is None


def test_a_flat_object_that_shears_most_of_the_gel_is_no_drift() -> None:
    """Two thirds of the markers move as one piece, and the others tell that it is no drift."""
    places = lattice().positions_px
    away = np.maximum(places[:, 0] - np.quantile(places[:, 0], 0.65), 0) / PX_PER_MM
    load = np.column_stack([0 * away, 3.0 * np.exp(-away / 0.8)])
    follower = DriftFilter(lattice(), DriftSettings())
    follower.update(tracks(moved(Similarity())), NOISE_PX)
    frame = follower.update(tracks(moved(Similarity(), seed=1) + load), NOISE_PX)
    assert frame.problem == ""
    assert not frame.untouched
    assert np.abs(frame.similarity.vector[:2]).max() < 0.03


def test_the_filter_follows_scatters_as_it_says_and_holds_under_contact() -> None:
    follower, drift = DriftFilter(lattice(), DriftSettings()), Similarity(0.3 + 0.1j)
    found = [follower.update(tracks(moved(drift, seed=k)), NOISE_PX) for k in range(30)]
    off = np.array([f.similarity.vector - drift.vector for f in found])[:, :2]
    # After the jump of the first frame the mean of the frames is better than any of them.
    assert np.abs(off).max() < 0.01
    assert np.abs(off[-1]).max() < 0.004
    total = found[-1].covariance + NOISE_PX**2 * np.einsum(
        "pni,qni->pq", found[-1].gain, found[-1].gain
    )
    assert (np.abs(off[-1]) < 3 * np.sqrt(np.diag(total)[:2])).all()
    everywhere = np.random.default_rng(3).normal(0, 5, (342, 2))
    held = [follower.update(tracks(everywhere), NOISE_PX) for _ in range(50)]
    assert held[-1].similarity == found[-1].similarity
    assert not held[-1].gain.any()
    grown = np.sqrt([held[0].covariance[0, 0], held[-1].covariance[0, 0]])
    assert grown[1] ** 2 - grown[0] ** 2 == pytest.approx(49e-6, rel=0.1)


@pytest.mark.parametrize(
    ("drift", "words"),
    [
        (Similarity(0.6 + 0j), "shifted by 0.6 px"),
        (Similarity(0j, 0.004 + 0j), "scaled by 1.0040"),
        (Similarity(0j, 0.006j), "rotated by 0.34°"),
    ],
)
def test_large_drift_is_refused_until_it_is_the_rest(drift: Similarity, words: str) -> None:
    follower = DriftFilter(lattice(), DriftSettings())
    assert follower.update(tracks(moved(Similarity())), NOISE_PX).problem == ""
    seen = tracks(moved(drift, seed=1))
    frame = follower.update(seen, NOISE_PX)
    assert words in frame.problem
    record = follower.tare(frame, seen, 2.5)
    assert record.time_s == 2.5
    assert complex(*record.shift_px) == pytest.approx(drift.shift_px, abs=0.01)
    assert record.scale == pytest.approx(drift.scale, abs=1e-4)
    assert record.residual_px == pytest.approx(NOISE_PX, rel=0.1)
    assert follower.log == (record,)
    assert follower.update(seen, NOISE_PX).problem == ""
    follower.reset()
    assert follower.update(seen, NOISE_PX).problem == ""
    assert follower.update(tracks(moved(Similarity())), NOISE_PX).problem != ""


def test_no_rest_with_contact_or_far_away_or_with_few_markers() -> None:
    follower = DriftFilter(lattice(), DriftSettings())
    for motion in (moved(Similarity(), 0.3), moved(Similarity(2.5 + 0j))):
        seen = tracks(motion)
        with pytest.raises(TareError):
            follower.tare(follower.update(seen, NOISE_PX), seen, 0.0)
    seen = tracks(moved(Similarity()))
    frame = follower.update(seen, NOISE_PX)
    status = np.where(np.arange(len(seen)) < 100, MarkerStatus.LOST, MarkerStatus.TRACKED)
    few = Tracks(seen.positions_px, seen.displacement_px, status, seen.dots)
    with pytest.raises(TareError, match="71%"):
        follower.tare(frame, few, 0.0)
    assert follower.log == ()


def test_the_rest_follows_slow_drift_if_asked_for() -> None:
    """A creep of 1.2 px in 300 frames is beyond the limit, and is followed."""
    follower = DriftFilter(lattice(), DriftSettings(rezero_frames=40))
    alone = DriftFilter(lattice(), DriftSettings())
    refused = {True: 0, False: 0}
    for k in range(300):
        seen = tracks(moved(Similarity(0.004 * k), seed=k))
        frame = follower.update(seen, NOISE_PX)
        follower.rezero(frame, float(k))
        refused[True] += frame.problem != ""
        refused[False] += alone.update(seen, NOISE_PX).problem != ""
    assert refused[True] == 0
    assert refused[False] > 100
    assert len(follower.log) == 7
    assert all(record.automatic for record in follower.log)
    assert follower.log[-1].shift_px[0] == pytest.approx(0.004 * 259.5, abs=0.02)


def test_without_correction_the_drift_is_an_error_of_the_motion() -> None:
    seen, drift = tracks(moved(Similarity(0.3 + 0j))), 0.3
    frame = DriftFilter(lattice(), DriftSettings(correct=False)).update(seen, NOISE_PX)
    assert frame.positions_px == pytest.approx(seen.positions_px, abs=1e-9)
    assert np.sqrt(frame.covariance[0, 0]) == pytest.approx(drift, rel=0.05)


@pytest.mark.parametrize(
    "bad", [{"most_px": -1.0}, {"walk_px": float("nan")}, {"rezero_frames": 0}]
)
def test_impossible_settings_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(bad))):
        DriftSettings(**bad)


def test_the_compiled_step_is_that_of_a_kalman_filter() -> None:
    rng = np.random.default_rng(5)
    unknown, most = np.array([100.0, 100.0, 1e-2, 1e-2]), 0.025
    both = set()
    for far in (0.1, 3.0):
        known, fit = rng.normal(size=4), rng.normal(size=(4, 60))
        root = rng.normal(size=(4, 4))
        covariance, load, own = root @ root.T, rng.uniform(size=4), rng.uniform(size=4)
        found = known + far * rng.normal(size=4)
        step, noise = found - known, 0.3
        before = covariance + np.diag(load)
        measured = noise * fit @ fit.T + np.diag(own)
        jumps = step @ np.linalg.inv(before + measured) @ step > most
        before = before + np.diag(unknown) * jumps
        gain = before @ np.linalg.inv(before + measured)
        left = (np.eye(4) - gain) @ (covariance + np.diag(unknown) * jumps)
        both.add(bool(jumps))
        share, estimate = combined(
            known, covariance, load, found, fit, (noise, own), (most, unknown)
        )
        assert share == pytest.approx(gain, rel=1e-9)
        assert estimate == pytest.approx(known + gain @ step, rel=1e-9)
        expected = left @ (np.eye(4) - gain).T
        assert left_over(covariance, share) == pytest.approx(expected, rel=1e-9)
        assert squared_sigmas(before, step) == pytest.approx(step @ np.linalg.solve(before, step))
    assert both == {False, True}
