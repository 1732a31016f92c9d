"""Centroids of strained dots against a closed form, fine quadrature, and what a detector finds."""

from __future__ import annotations

import numpy as np
import pytest
from ball_presses import Built, ball_calibration, ball_picture
from camera_rig import finger_view, off_centre_view
from numpy.typing import NDArray
from pressed_disc import pressed_disc
from scipy.interpolate import CubicSpline
from synthetic import grid_of_dots

from gelslim_force.motion.printed_dots import PrintedDots, disc_rims_mm, rim_centroids

Array = NDArray[np.float64]
GRID = grid_of_dots()


def printed() -> PrintedDots:
    """All dots of the grid at rest."""
    rest = np.column_stack([GRID.positions_mm, np.zeros(len(GRID))])
    return PrintedDots(off_centre_view(), rest, GRID.diameter_mm)


def test_dots_that_the_gel_carries_without_strain_move_with_their_middle() -> None:
    dots = printed()
    still = np.zeros_like(dots.rims_mm)
    assert np.abs(dots.shift_px(still)).max() == 0
    carried = np.array([0.3, -0.2, -0.4])
    moved = dots.shift_px(still + carried)
    middle = dots.camera.project(dots.rest_mm + carried)
    # What perspective does to a disc hardly changes over such a way.
    assert np.abs(moved - (middle - dots.camera.project(dots.rest_mm))).max() < 1e-3


def test_a_motion_of_second_order_shifts_the_centroid_by_the_closed_form() -> None:
    """R²/8 (∇²u + 2 ∇ div u), in the plane and to first order in the motion."""
    rng = np.random.default_rng(4)
    middle, radius, size = np.array([[0.7, -1.3]]), 0.3, 1e-6
    bent = rng.normal(size=(2, 2, 2))
    bent = (bent + bent.transpose(0, 2, 1)) / 2
    rim = disc_rims_mm(middle, 2 * radius)
    offset = rim - middle[:, None]
    moved = 0.5 * np.einsum("ijk,naj,nak->nai", bent, offset, offset)
    shift = (rim_centroids(rim + size * moved) - middle) / size
    laplacian, of_div = np.einsum("ijj->i", bent), np.einsum("jji->i", bent)
    np.testing.assert_allclose(shift[0], radius**2 / 8 * (laplacian + 2 * of_div), atol=1e-7)


def test_centroids_are_means_over_the_deformed_disc() -> None:
    """10,000 points of a disc, weighted by the area that a strong strain gives to each."""
    count = np.arange(10_000)
    ring, turn = np.sqrt((count + 0.5) / len(count)), count * np.pi * (3 - np.sqrt(5))
    places = 0.25 * ring[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])

    def moved(at: Array) -> Array:
        x, y = at[..., 0], at[..., 1]
        lateral = np.stack([0.3 * x + 0.2 * y + 0.5 * x * x - 0.4 * y * y, 0.6 * x * y], axis=-1)
        return np.concatenate([lateral, (0.4 * x * x - 0.8 * y * y + 0.2 * x)[..., None]], axis=-1)

    camera = finger_view()
    dots = PrintedDots(camera, np.zeros((1, 3)), np.array([0.5]))
    found = dots.shift_px(moved(dots.rims_mm[..., :2]))

    def mean(carried: bool) -> Array:
        def seen(at: Array) -> Array:
            flat = np.column_stack([at, np.zeros(len(at))])
            return camera.project(flat + carried * moved(at))

        along, across = 1e-4 * np.eye(2)
        by_x = seen(places + along) - seen(places - along)
        by_y = seen(places + across) - seen(places - across)
        area = by_x[:, 0] * by_y[:, 1] - by_x[:, 1] * by_y[:, 0]
        return np.asarray(area @ seen(places) / area.sum())

    expected = mean(carried=True) - mean(carried=False)
    assert np.hypot(*expected) > 0.1
    np.testing.assert_allclose(found[0], expected, atol=1e-3)


def test_arrays_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="disc centres"):
        disc_rims_mm(np.zeros((4, 3)), 0.4)
    with pytest.raises(ValueError, match="shape"):
        disc_rims_mm(np.zeros((4, 2)), np.full(3, 0.4))


@pytest.mark.slow
def test_detected_dots_of_presses_are_where_the_strained_dots_are() -> None:
    """Drawn dots in and beside contacts of finite elements; the motion of their middle errs."""
    calibration = ball_calibration()
    markers = calibration.reference.markers
    rest = calibration.reference_px[np.searchsorted(calibration.markers, markers)]
    flat = np.column_stack([GRID.positions_mm[markers], np.zeros(len(markers))])
    dots = PrintedDots(off_centre_view(), flat, GRID.diameter_mm[markers])
    left: dict[str, list[Array]] = {"centroid": [], "middle": []}
    for number, (ball, force) in enumerate(((3.0, 3.0), (6.0, 4.5), (8.0, 6.0))):
        place = np.random.default_rng([8, number]).uniform(-4, 4, 2)
        built = Built(ball_mm=ball)
        picture = ball_picture(built, 0.147 * force, place, number, noise=0.5)
        tracks = calibration.tracker().update(picture).tracks
        radius, outward, height = pressed_disc(ball, 2.0, 0.48).at_force(force)
        disc = pressed_disc(ball, 2.0, 0.48)
        out, down = CubicSpline(disc.r_mm, outward), CubicSpline(disc.r_mm, height)

        def motion(at: Array, place: Array = place, out: CubicSpline = out,
                   down: CubicSpline = down) -> Array:  # fmt: skip
            away = at - place
            r = np.hypot(away[..., 0], away[..., 1])
            aside = away * (out(r) / np.maximum(r, 1e-9))[..., None]
            return np.concatenate([aside, down(r)[..., None]], axis=-1)

        expected = {
            "centroid": dots.shift_px(motion(dots.rims_mm[..., :2])),
            "middle": dots.camera.project(flat + motion(flat[:, :2])) - dots.camera.project(flat),
        }
        near = np.hypot(*(flat[:, :2] - place).T) < radius + 0.25
        assert tracks.tracked[near].all()
        for name, shift in expected.items():
            left[name].append((tracks.positions_px - rest - shift)[near])
    rms = {name: np.sqrt(np.mean(np.vstack(parts) ** 2)) for name, parts in left.items()}
    assert rms["centroid"] < 0.03
    assert rms["middle"] > 1.6 * rms["centroid"]
