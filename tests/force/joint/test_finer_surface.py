"""Heights between the nodes under nodal forces, against the closed form of a bonded layer."""

from __future__ import annotations

import numpy as np
from hertz_on_layer import RADIUS_MM, nodal_forces, true_heights
from sensor_samples import sensor_bundle

from gelslim_force.joint.finer_surface import FinerSurface
from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.layer.beyond_mesh import REACH, EndlessLayers, finer_response
from ifem_export.compliance.columns import SurfaceCompliance


def test_stencil_is_local() -> None:
    stencil = np.abs(finer_response(EndlessLayers.of(sensor_bundle())))
    rim = max(stencil[[0, -1]].max(), stencil[:, [0, -1]].max())
    assert rim < 0.05 * stencil[REACH, REACH, 2]


def test_heights_and_slopes_at_the_rim_of_hertz_pressure() -> None:
    """Closer to the closed form than cubic convolution of the nodes, in height and in slope."""
    bundle = sensor_bundle()
    points = np.asarray(bundle.mesh.surface_mm)
    lattice = NodeLattice.of(points, np.asarray(bundle.mesh.cell_size_mm[:2]))
    finer = FinerSurface.of(lattice, finer_response(EndlessLayers.of(bundle)))
    force = nodal_forces(lattice)
    nodes = np.flatnonzero(force[:, 2])
    moved = SurfaceCompliance(bundle).displacement(nodes, force[nodes])
    heights = finer.heights(moved[:, 2], nodes, force[nodes])
    places = finer.lattice.origin_mm + finer.lattice.place * finer.lattice.step_mm
    near = np.hypot(*places.T) < 1.5 * RADIUS_MM
    true, plain = true_heights(places[near]), finer.interpolation @ moved[:, 2]
    errors = [np.sqrt(np.mean((h[near] - true) ** 2)) for h in (heights, plain)]
    assert errors[0] < 0.6 * errors[1]
    rng = np.random.default_rng(1)
    turn, radius = rng.uniform(0, 2 * np.pi, 400), rng.uniform(0.7, 1.3, 400) * RADIUS_MM
    out = np.column_stack([np.cos(turn), np.sin(turn)])
    at = radius[:, None] * out
    step = 1e-3 * out
    slope = (true_heights(at + step) - true_heights(at - step)) / 2e-3
    seen = [
        (taps.slopes(h) * out).sum(axis=1)
        for taps, h in (
            (finer.lattice.slopes_at(at), heights),
            (lattice.slopes_at(at), moved[:, 2]),
        )
    ]
    gains = [float(s @ slope / (s @ s)) for s in seen]
    assert abs(gains[0] - 1) < 0.02 < abs(gains[1] - 1)
