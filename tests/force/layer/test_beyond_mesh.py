"""What a mesh leaves out near a force, against closed forms of a bonded layer."""

from __future__ import annotations

import numpy as np
from hertz_on_layer import nodal_forces, true_heights
from numpy.typing import NDArray
from sensor_samples import sensor_bundle

from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.responses import Responses
from gelslim_force.layer.beyond_mesh import EndlessLayers, NearMotion, finer_response
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.markers.interpolation import marker_to_node

Array = NDArray[np.float64]
DISC_MM = 0.25


def mean_of_discs(middle: Array) -> Array:
    """True heights, averaged over the discs."""
    radius = DISC_MM * np.sqrt((np.arange(4) + 0.5) / 4)
    turn = 2 * np.pi / 12 * np.arange(12)
    ring = np.stack([np.outer(radius, np.cos(turn)), np.outer(radius, np.sin(turn))], axis=-1)
    places = middle[:, None] + ring.reshape(-1, 2)
    return true_heights(places.reshape(-1, 2)).reshape(len(middle), -1).mean(axis=1)


def test_discs_sink_under_hertz_pressure_as_the_closed_form_says() -> None:
    """In a view whose picture shows the height along x."""
    bundle, rng = sensor_bundle(), np.random.default_rng(7)
    points = np.asarray(bundle.mesh.surface_mm)
    lattice = NodeLattice.of(points, np.asarray(bundle.mesh.cell_size_mm[:2]))
    force = nodal_forces(lattice)
    nodes, markers = np.flatnonzero(force[:, 2]), rng.uniform(-4, 4, (80, 2))
    near = NearMotion.of(EndlessLayers.of(bundle), DISC_MM)
    lean = np.tile([-1e3, 0.0], (len(markers), 1))
    given = SurfaceCompliance(bundle), marker_to_node(points, markers), lean
    true, every = mean_of_discs(markers), np.arange(len(markers))
    found = []
    for beyond in (None, (near, markers)):
        responses = Responses(*given, beyond)
        rows = responses.of_markers(nodes, every)
        sunk = (rows @ force[nodes].ravel()).reshape(-1, 2)[:, 0] / 1e3
        found.append(np.sqrt(np.mean((sunk - true) ** 2)))
        more = responses.beyond_mesh(nodes, force[nodes], every)
        assert more.any() == (beyond is not None)
    # What is left is that forces on nodes cannot end a pressure between them.
    assert found[1] < 0.7 * found[0]
    assert found[1] < 0.01 * np.abs(true).max()


def test_stencils_of_heights_are_even_and_odd() -> None:
    """By a normal force even, by a tangential one odd along its axis."""
    stencil = finer_response(EndlessLayers.of(sensor_bundle()))
    size = np.abs(stencil).max()
    np.testing.assert_allclose(stencil[..., 2], stencil[::-1, ::-1, 2], atol=1e-9 * size)
    np.testing.assert_allclose(stencil[..., 0], -stencil[::-1, :, 0], atol=1e-9 * size)
    np.testing.assert_allclose(stencil[..., 1], -stencil[:, ::-1, 1], atol=1e-9 * size)
