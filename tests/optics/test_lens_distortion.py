"""Distortion by both models: against its definition, its inverse and the edge of its domain."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from gelslim_optics.camera import lens_distortion, undistort_kernel
from gelslim_optics.camera.lens_distortion import LensDistortion

LENSES = [
    LensDistortion(),
    LensDistortion(k1=-0.32, k2=0.11, p1=8e-4, p2=-5e-4, k3=-0.018),
    LensDistortion(k1=-0.2),
    LensDistortion(k1=0.15, k2=-0.05),
    LensDistortion(p1=0.01, p2=0.02),
    # Newton's full steps leave the disc near its rim: they must be halved up to four times.
    LensDistortion(k1=0.72, k2=0.17, p1=0.0315, p2=-0.0087, k3=-0.196),
    LensDistortion(k1=0.7, k2=-0.25, p1=0.012, p2=-0.019, k3=-0.05),
    LensDistortion(model="kannala_brandt"),
    LensDistortion(k1=-0.04, k2=0.02, k3=-0.012, k4=0.003, model="kannala_brandt"),
    LensDistortion(k1=0.1, k2=-0.2, p1=8e-4, p2=-5e-4, model="kannala_brandt"),
]


def disc(radius: float, count: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    rho = radius * np.sqrt(rng.random(count))
    angle = rng.uniform(0, 2 * np.pi, count)
    return np.column_stack([rho * np.cos(angle), rho * np.sin(angle)])


def test_hand_worked_point() -> None:
    # ρ² = 0.25, f = 1 - 0.3/4 + 0.1/16 + 0.02/64 = 0.9315625
    lens = LensDistortion(k1=-0.3, k2=0.1, p1=0.001, p2=0.002, k3=0.02)
    x = 0.3 * 0.9315625 + 2 * 0.001 * 0.12 + 0.002 * (0.25 + 0.18)
    y = 0.4 * 0.9315625 + 0.001 * (0.25 + 0.32) + 2 * 0.002 * 0.12
    np.testing.assert_allclose(lens.distort([[0.3, 0.4]]), [[x, y]], rtol=1e-15)


def test_agrees_with_opencv() -> None:
    cv2 = pytest.importorskip("cv2")
    points = disc(0.6, 50)
    for lens in LENSES:
        objects = np.column_stack([points, np.ones(50)])
        none = np.zeros(3)
        if lens.fisheye:
            radial = np.array([lens.k1, lens.k2, lens.k3, lens.k4])
            theirs, _ = cv2.fisheye.projectPoints(objects[:, None], none, none, np.eye(3), radial)
            ours = replace(lens, p1=0.0, p2=0.0).distort(points)
        else:
            coefficients = np.array([lens.k1, lens.k2, lens.p1, lens.p2, lens.k3])
            theirs, _ = cv2.projectPoints(objects, none, none, np.eye(3), coefficients)
            ours = lens.distort(points)
        np.testing.assert_allclose(ours, theirs.reshape(-1, 2), atol=1e-14)


@pytest.mark.parametrize("lens", LENSES)
def test_inverse_finds_every_point_of_the_monotone_disc(lens: LensDistortion) -> None:
    radius = min(lens.monotone_radius, 3.0)
    points = np.vstack([disc(0.999 * radius, 4000), np.zeros((1, 2)), disc(1e-9, 20)])
    back = lens.undistort(lens.distort(points))
    slack = np.linalg.cond(lens.jacobian(points))
    assert np.all(np.hypot(*(back - points).T) < 1e-14 * slack)


@pytest.mark.parametrize("lens", LENSES)
def test_jacobian_is_the_derivative(lens: LensDistortion) -> None:
    points = disc(0.5, 60, seed=1)
    h = 1e-3
    for axis in range(2):
        e = h * np.eye(2)[axis]
        d = lens.distort
        fourth = (d(points - 2 * e) - 8 * d(points - e) + 8 * d(points + e) - d(points + 2 * e)) / (
            12 * h
        )
        np.testing.assert_allclose(lens.jacobian(points)[:, :, axis], fourth, atol=1e-10)


def test_monotone_radius_of_one_coefficient_is_the_closed_form() -> None:
    # (ρ + k1 ρ³)' = 0 at ρ = 1/sqrt(-3 k1)
    assert LensDistortion(k1=-0.2).monotone_radius == pytest.approx(1 / np.sqrt(0.6), rel=1e-12)
    assert LensDistortion(k1=0.2).monotone_radius == np.inf
    assert LensDistortion().monotone_radius == np.inf
    # (θ + k1 θ³)' = 0 at θ = 1/sqrt(-3 k1); an ideal f-theta lens never folds
    wide = LensDistortion(k1=-0.2, model="kannala_brandt")
    assert wide.monotone_radius == pytest.approx(np.tan(1 / np.sqrt(0.6)), rel=1e-12)
    assert LensDistortion(model="kannala_brandt").monotone_radius == np.inf
    # Decentring alone: 6 |p| ρ = 1
    assert LensDistortion(p1=0.03, p2=0.04).monotone_radius == pytest.approx(1 / 0.3, rel=1e-12)


def test_the_jacobian_keeps_its_sign_in_the_disc_and_loses_it_just_beyond() -> None:
    rng = np.random.default_rng(2)
    lost = 0
    for trial in range(40):
        k1, k2, k3 = rng.normal(0, 0.3, 3)
        p1, p2 = rng.normal(0, 0.02, 2)
        model: Literal["brown", "kannala_brandt"] = "kannala_brandt" if trial % 3 == 0 else "brown"
        lens = LensDistortion(k1, k2, p1, p2, k3, model=model)
        radius = lens.monotone_radius
        if not np.isfinite(radius):
            continue
        inside = np.vstack([disc(0.999999 * radius, 2000), radius * 0.999999 * _circle(720)])
        assert np.linalg.eigvalsh(lens.jacobian(inside)).min() > 0
        radial = replace(lens, p1=0.0, p2=0.0)
        if np.isfinite(radial.monotone_radius):
            ring = 1.0001 * radial.monotone_radius * _circle(8)
            lost += np.linalg.det(radial.jacobian(ring)).max() < 0
    assert lost > 20


def _circle(count: int) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def test_points_beyond_the_fold_are_refused_both_ways() -> None:
    lens = LensDistortion(k1=-0.2)
    edge = lens.monotone_radius
    image = edge * (1 - 0.2 * edge**2)
    assert np.isfinite(lens.undistort([[0.9999 * image, 0.0]])).all()
    with pytest.raises(ValueError, match="monotone"):
        lens.distort([[1.001 * edge, 0.0], [0.1, 0.1]])
    with pytest.raises(ValueError, match=r"1 of 2 points.*monotone"):
        lens.undistort([[1.001 * image, 0.0], [0.1, 0.1]])
    with pytest.raises(ValueError, match="monotone"):
        LENSES[1].undistort(30.0 * _circle(4))


def test_missing_points_stay_missing() -> None:
    lens = LENSES[1]
    there_and_back = lens.undistort(lens.distort([[0.1, 0.2], [np.nan, 0.0]]))
    np.testing.assert_allclose(there_and_back[0], [0.1, 0.2], rtol=1e-14)
    assert np.isnan(there_and_back[1]).all()


def test_record_round_trip_and_refusals() -> None:
    for lens in LENSES:
        assert LensDistortion.from_record(lens.to_record()) == lens
    assert LensDistortion.from_record({"k1": -1}) == LensDistortion(k1=-1.0)
    refused = ({"k4": 0.1}, {"k9": 0.1}, {"k1": "0.1"}, {"p1": None}, {"k1": True}, {"model": "f"})
    for record in refused:
        with pytest.raises(ValueError, match="lens distortion"):
            LensDistortion.from_record(record)
    with pytest.raises(ValueError, match="finite"):
        LensDistortion(k1=float("nan"))


def test_the_compiled_steps_find_what_the_careful_ones_do() -> None:
    rng = np.random.default_rng(8)
    for _ in range(6):
        k1, k2, p1, p2 = rng.normal(0, [0.08, 0.03, 2e-3, 2e-3])
        lens = LensDistortion(k1=k1, k2=k2, p1=p1, p2=p2)
        reach = min(0.8, 0.7 * lens.monotone_radius)
        true = rng.uniform(-reach / 1.5, reach / 1.5, (200, 2))
        seen = lens.distort(true)
        seen[3] = np.nan
        whole = lens.undistort(seen)
        one_by_one = np.vstack([lens.undistort(row[None]) for row in seen])
        assert np.isnan(whole[3]).all()
        keep = np.arange(200) != 3
        assert np.abs(whole - one_by_one)[keep].max() < 1e-14
        assert np.abs(whole - true)[keep].max() < 1e-13


def compiled(lens: LensDistortion, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    coefficients = np.array([lens.k1, lens.k2, lens.k3, lens.k4, lens.p1, lens.p2])
    out, converged = np.full_like(seen, 7.0), np.zeros(len(seen), dtype=bool)
    radius = lens.monotone_radius
    undistort_kernel.undistort(seen, coefficients, lens.fisheye, radius, out, converged)
    return out, converged


@pytest.mark.parametrize("lens", LENSES)
def test_compiled_steps_converge_by_themselves_where_the_lens_bends_little(
    lens: LensDistortion,
) -> None:
    """Their derivative is exact, or they would not reach the last digits in a few steps."""
    true = disc(0.35 * min(lens.monotone_radius, 1.0), 300, seed=3)
    found, converged = compiled(lens, lens.distort(true))
    assert converged.all()
    np.testing.assert_allclose(found, true, atol=2e-15)


def test_compiled_steps_need_few_evaluations(monkeypatch: pytest.MonkeyPatch) -> None:
    """Newton's method doubles the digits in each step, by the plain function as well."""
    monkeypatch.setattr(lens_distortion, "MAX_NEWTON_STEPS", 6)
    for lens in LENSES:
        true = disc(0.35 * min(lens.monotone_radius, 1.0), 40, seed=4)
        np.testing.assert_allclose(lens.undistort(lens.distort(true)), true, atol=4e-15)


def test_compiled_steps_refuse_what_lies_beyond_the_disc() -> None:
    """A radial lens has a second, wrong solution beyond the fold."""
    lens = LensDistortion(k1=-0.2)
    beyond = 1.05 * lens.monotone_radius * _circle(16)
    seen = beyond * (1 - 0.2 * (1.05 * lens.monotone_radius) ** 2)
    for start in (seen, beyond):
        found, converged = compiled(lens, np.ascontiguousarray(start))
        inside = np.hypot(*found.T) < lens.monotone_radius
        assert not (converged & ~inside).any()


def test_few_points_need_no_compiled_steps_and_many_take_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[int] = []

    def spy(target: np.ndarray, *_: object) -> None:
        asked.append(len(target))

    monkeypatch.setattr(undistort_kernel, "undistort", spy)
    monkeypatch.setattr(lens_distortion, "BLOCK", 7)
    lens = LENSES[1]
    for count in (63, 64, 100):
        true = disc(0.5, count, seed=5)
        np.testing.assert_allclose(lens.undistort(lens.distort(true)), true, atol=1e-14)
    assert asked == [64, 100]


def test_monotone_radius_is_the_first_at_which_the_map_is_no_longer_convex() -> None:
    """Against the least eigenvalue over directions and along the radius, in small steps."""
    rng = np.random.default_rng(6)
    for _ in range(12):
        k1, k2, k3 = rng.normal(0, 0.3, 3)
        lens = LensDistortion(k1, k2, k3=k3)
        rho = np.linspace(0, 3, 30_001)
        square = rho**2
        around = 1 + square * (k1 + square * (k2 + square * k3))
        outward = 1 + square * (3 * k1 + square * (5 * k2 + square * 7 * k3))
        lost = np.flatnonzero(np.minimum(around, outward) <= 0)
        expected = rho[lost[0]] if len(lost) else np.inf
        if expected < np.inf or lens.monotone_radius < 3:
            assert lens.monotone_radius == pytest.approx(expected, abs=2e-4)
        p = 0.03
        bent = LensDistortion(k1, k2, 0.6 * p, 0.8 * p, k3)
        lost = np.flatnonzero(np.minimum(around, outward) <= 6 * p * rho)
        if len(lost):
            assert bent.monotone_radius == pytest.approx(rho[lost[0]], abs=2e-4)
