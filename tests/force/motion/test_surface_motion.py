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


def test_covariance_is_that_of_the_positions_in_the_picture(surface) -> None:
    known = np.ones(len(surface.markers), dtype=bool)
    known[5] = False
    found = surface.covariance_mm2(known, 0.2)
    assert not found[NOT_FOLLOWED].any()
    assert not found[surface.markers[5]].any()
    k = 20
    inverse = np.linalg.inv(CAMERA.jacobian(surface.view.rest_mm[k : k + 1])[0])
    assert found[surface.markers[k]] == pytest.approx(0.04 * inverse @ inverse.T)


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
