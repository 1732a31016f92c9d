"""Motion of the surface from that of the markers: apparent motion and its place in the noise."""

from __future__ import annotations

import numpy as np
import pytest
from camera_rig import off_centre_view
from pad_samples import small_bundle

from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.motion.marker_motion import MarkerView
from gelslim_force.motion.surface_motion import SurfaceMotion

CAMERA = off_centre_view()
NOT_FOLLOWED = 3


@pytest.fixture(scope="module")
def surface() -> SurfaceMotion:
    """All markers of a small pad but one."""
    markers = small_bundle().markers
    followed = np.delete(np.arange(len(markers.positions_mm)), NOT_FOLLOWED)
    at = np.asarray(markers.positions_mm)[followed]
    view = MarkerView(CAMERA, CAMERA.project(np.column_stack([at, np.zeros(len(at))])))
    points = np.asarray(small_bundle().mesh.surface_mm)
    return SurfaceMotion(view, followed, markers.sparse, points)


def moved(surface: SurfaceMotion, size_mm: float) -> np.ndarray:
    """One marker moves by 3-4-5 times `size_mm`, one by half of that, the others are at rest."""
    motion = np.zeros((len(surface.markers), 3))
    motion[10, :2] = [0.6 * size_mm, -0.8 * size_mm]
    motion[11, :2] = [0.0, 0.5 * size_mm]
    motion[12] = np.nan
    return motion


def test_apparent_motion_per_mm_is_the_cameras(surface) -> None:
    step_mm = 1e-4
    rest = surface.view.rest_mm
    risen = CAMERA.project(rest + np.array([0, 0, step_mm]))
    seen = CAMERA.backproject(risen, 0.0)[:, :2] - rest[:, :2]
    assert surface.apparent_per_mm[surface.markers] == pytest.approx(seen / step_mm, rel=2e-3)
    assert surface.apparent_per_mm[NOT_FOLLOWED].tolist() == [0.0, 0.0]


def test_large_motion_is_taken_to_sink_by_the_whole_depth(surface) -> None:
    """The marker that moves farthest sinks by 0.3 mm, the others in proportion."""
    found = surface.apparent_motion(moved(surface, 0.5), 0.3)
    per_mm = surface.apparent_per_mm
    of = surface.markers
    assert found[of[10]] == pytest.approx(-0.3 * per_mm[of[10]])
    assert found[of[11]] == pytest.approx(-0.15 * per_mm[of[11]])
    assert not np.delete(found, [of[10], of[11]], axis=0).any()


def test_small_motion_is_taken_to_sink_by_three_times_itself(surface) -> None:
    found = surface.apparent_motion(moved(surface, 0.02), 0.3)
    per_mm = surface.apparent_per_mm
    of = surface.markers
    assert found[of[10]] == pytest.approx(-0.06 * per_mm[of[10]])
    assert found[of[11]] == pytest.approx(-0.03 * per_mm[of[11]])
    # The two rules meet where the motion is a third of the depth.
    at_limit = surface.apparent_motion(moved(surface, 0.1), 0.3)[of[10]]
    assert at_limit == pytest.approx(-0.3 * per_mm[of[10]])


def test_noise_is_not_taken_to_sink(surface) -> None:
    """Three standard deviations of a coordinate are taken off in quadrature."""
    motion = moved(surface, 0.02)
    of, per_mm = surface.markers, surface.apparent_per_mm
    found = surface.apparent_motion(motion, 0.3, noise_mm=0.004)
    left = np.sqrt(0.02**2 - 0.012**2)
    assert found[of[10]] == pytest.approx(-3 * left * per_mm[of[10]])
    assert not np.delete(found, of[10], axis=0).any()


def test_apparent_over_seen_of_a_true_and_of_a_false_contact(surface) -> None:
    """Markers show the apparent motion of a depth of 0.4 mm where the gel is pressed in."""
    away = np.hypot(surface.points_mm[:, 0] - 2.0, surface.points_mm[:, 1] + 1.0)
    w = np.where(away < 2.5, -0.4, 0.0)
    reading = NormalReading(w, 0 * w, away < 2.5)
    height = surface.nodes_to_markers @ w
    at_rest = surface.view.reference_px
    pressed = CAMERA.project(surface.view.rest_mm + height[:, None] * [0.0, 0.0, 1.0])
    true = surface.of_markers(pressed, reading)
    assert np.abs(true[:, :2]).max() < 1e-9
    assert true[:, 2] == pytest.approx(height)
    assert 0.8 < surface.apparent_over_seen(true, reading) < 1.0
    false = surface.of_markers(at_rest, reading)
    assert surface.apparent_over_seen(false, reading) > 4.0
    assert surface.in_contact(true, reading) == pytest.approx([0.0, 0.0], abs=1e-9)
    nothing = NormalReading(w, 0 * w, None)
    assert surface.in_contact(true, nothing) is None
    assert surface.apparent_over_seen(false, nothing) == 0.0


def test_ratio_of_apparent_and_seen_motion_by_its_formula(surface) -> None:
    away = np.hypot(surface.points_mm[:, 0] - 2.0, surface.points_mm[:, 1] + 1.0)
    w = -0.3 * np.exp(-((away / 3.0) ** 2))
    reading = NormalReading(w, 0 * w, away < 2.5)
    rng = np.random.default_rng(4)
    motion = rng.normal(0, 0.1, (len(surface.markers), 3))
    motion[7, 0] = np.nan
    share = surface.nodes_to_markers @ (away < 2.5).astype(float)
    inside = (share > 0.5) & np.isfinite(motion[:, 0])
    assert 3 < inside.sum() < len(inside) / 2
    depth = surface.nodes_to_markers @ w
    apparent = surface.apparent_per_mm[surface.markers] * depth[:, None]
    seen = motion[:, :2] + apparent
    rms = [np.sqrt(np.mean(v[inside] ** 2)) for v in (apparent, seen)]
    assert surface.apparent_over_seen(motion, reading) == pytest.approx(rms[0] / (rms[1] + 0.01))
    found = surface.in_contact(motion, reading)
    assert found == pytest.approx(motion[inside, :2].mean(axis=0))


def test_motion_is_told_from_noise_by_the_fourth_largest(surface) -> None:
    motion = np.zeros((len(surface.markers), 3))
    motion[:3, :2] = [0.3, 0.4]
    assert not surface.moved(motion)
    motion[3, :2] = [0.0, 0.029]
    assert not surface.moved(motion)
    motion[3, :2] = [0.0248, 0.0186]
    assert surface.moved(motion)
    motion[3, 0] = np.nan
    assert not surface.moved(motion)
    # Of four markers or fewer the one that moves most decides.
    few = np.full_like(motion, np.nan)
    assert not surface.moved(few)
    few[:4] = 0.0
    few[2, :2] = [0.031, 0.0]
    assert surface.moved(few)
    few[2, :2] = [0.029, 0.0]
    assert not surface.moved(few)


def test_noise_of_positions_moves_the_nodes_by_the_scale_of_the_picture(surface) -> None:
    noise = np.random.default_rng(5).normal(0, 1, (len(surface.markers), 2))
    found = surface.of_noise(noise)
    of_all = np.zeros((surface.interpolation.n_markers, 2))
    for k, marker in enumerate(surface.markers):
        scale = np.linalg.inv(CAMERA.jacobian(surface.view.rest_mm[k : k + 1])[0])
        of_all[marker] = scale @ noise[k]
    np.testing.assert_allclose(found[:, :2], surface.interpolation(of_all), atol=1e-12)
    assert not found[:, 2].any()


def test_nodes_follow_the_markers_that_are_left(surface) -> None:
    motion = np.random.default_rng(6).normal(0, 0.1, (len(surface.markers), 3))
    motion[[4, 20]] = np.nan
    w = np.linspace(-0.2, 0.0, len(surface.points_mm))
    operator, u = surface.of_nodes(motion, NormalReading(w, 0 * w, None))
    of_all = np.full((surface.interpolation.n_markers, 2), np.nan)
    of_all[surface.markers] = motion[:, :2]
    lost = np.isnan(of_all).any(axis=1)
    assert np.flatnonzero(lost).tolist() == sorted(
        [NOT_FOLLOWED, surface.markers[4], surface.markers[20]]
    )
    left = surface.interpolation.with_missing(lost)
    np.testing.assert_allclose(u[:, :2], left(of_all), atol=1e-12)
    np.testing.assert_allclose(operator(of_all), left(of_all), atol=1e-12)
    np.testing.assert_array_equal(u[:, 2], w)
    _, blind = surface.of_nodes(motion, None)
    assert np.isnan(blind[:, 2]).all()
    lateral = surface.of_markers(surface.view.reference_px + 1.0, None)
    np.testing.assert_allclose(
        lateral[:, :2], surface.view.lateral_motion(surface.view.reference_px + 1.0)
    )
    assert np.isnan(lateral[:, 2]).all()


def test_a_gel_at_rest_that_does_not_sink_has_no_apparent_motion(surface) -> None:
    found = surface.apparent_motion(np.zeros((len(surface.markers), 3)), 0.0)
    assert found.shape == (surface.interpolation.n_markers, 2)
    assert not found.any()
