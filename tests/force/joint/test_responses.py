"""What a picture shows of forces on nodes, against the motion of the surface under them."""

from __future__ import annotations

import numpy as np
from sensor_samples import sensor_bundle

from gelslim_force.joint.responses import Responses
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.markers.interpolation import marker_to_node


def test_a_marker_shows_its_height_as_a_lateral_motion() -> None:
    rng, compliance = np.random.default_rng(3), SurfaceCompliance(sensor_bundle())
    points = np.asarray(sensor_bundle().mesh.surface_mm)
    at = rng.uniform(-3, 3, (12, 2))
    to_markers, by_height = marker_to_node(points, at), rng.normal(0, 0.4, (12, 2))
    responses = Responses(compliance, to_markers, by_height)
    nodes = np.flatnonzero(np.hypot(*(points[:, :2] - [0.5, -0.5]).T) < 1.5)
    markers = np.sort(rng.permutation(12)[:7])
    force = rng.normal(size=(len(nodes), 3))
    moved = to_markers @ compliance.displacement(nodes, force)
    expected = (moved[:, :2] - by_height * moved[:, 2:])[markers]
    found = responses.of_markers(nodes, markers) @ force.ravel()
    np.testing.assert_allclose(found, expected.ravel(), atol=1e-5 * np.abs(expected).max())
    assert responses.markers == 12
