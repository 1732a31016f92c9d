"""Heights between the nodes under nodal forces, against the closed form of a bonded layer."""

from __future__ import annotations

import numpy as np
from bonded_layer import stiffness_factor
from numpy.typing import NDArray
from scipy.special import j0
from sensor_samples import sensor_bundle

from gelslim_force.joint.finer_surface import FinerSurface
from gelslim_force.joint.node_lattice import NodeLattice
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.compliance.finer_response import FINER, REACH, finer_response, spread_force

Array = NDArray[np.float64]
RADIUS_MM, PRESSURE_MPA, PERIOD_MM, WAVES = 2.4, 0.02, 24.0, 240


def pressure(points_mm: Array) -> Array:
    """Hertz's pressure about the origin."""
    away = (points_mm**2).sum(axis=-1) / RADIUS_MM**2
    return np.asarray(PRESSURE_MPA * np.sqrt(np.maximum(1 - away, 0.0)))


def true_heights(points_mm: Array) -> Array:
    """Heights (n,) of an endless bonded layer by its closed form: Johnson, Contact Mechanics, 5.8.

    Hertz's pressure has the transform 2π p a² (sin t - t cos t) / t³ with t = k a.
    """
    gel, thickness = sensor_bundle().material, 2.0
    k = (np.arange(6000) + 0.5) * 0.02
    t = RADIUS_MM * k
    load = PRESSURE_MPA * RADIUS_MM**2 * (np.sin(t) - t * np.cos(t)) / t**3
    by_wave = 2 * (1 - gel.poissons_ratio**2) / gel.youngs_modulus_mpa
    by_wave = by_wave * stiffness_factor(k * thickness, gel.poissons_ratio) * load * 0.02
    return -np.asarray(j0(np.hypot(*points_mm.T)[:, None] * k) @ by_wave)


def nodal_forces(lattice: NodeLattice) -> Array:
    """(c, 3) ∫ N_j p by a fine midpoint rule."""
    parts = (np.arange(-20, 20) + 0.5) / 20
    at = lattice.origin_mm + lattice.place * lattice.step_mm
    force = np.zeros((len(at), 3))
    for u in parts:
        for v in parts:
            weight = (1 - abs(u)) * (1 - abs(v)) * np.prod(lattice.step_mm) / 20**2
            force[:, 2] -= weight * pressure(at + lattice.step_mm * [u, v])
    return force


def test_force_of_a_node_is_that_of_the_traction() -> None:
    found = spread_force(24)
    away = np.minimum(np.arange(24 * FINER), 24 * FINER - np.arange(24 * FINER))
    for node in range(24):
        hat = np.roll(np.maximum(1 - away / FINER, 0.0), FINER * node)
        np.testing.assert_allclose(hat @ found, float(node == 0), atol=1e-12)


def test_stencil_is_local() -> None:
    stencil = np.abs(finer_response(sensor_bundle()))
    rim = max(stencil[[0, -1]].max(), stencil[:, [0, -1]].max())
    assert rim < 0.05 * stencil[REACH, REACH, 2]


def test_heights_and_slopes_at_the_rim_of_hertz_pressure() -> None:
    """Closer to the closed form than cubic convolution of the nodes, in height and in slope."""
    bundle = sensor_bundle()
    points = np.asarray(bundle.mesh.surface_mm)
    lattice = NodeLattice.of(points, np.asarray(bundle.mesh.cell_size_mm[:2]))
    finer = FinerSurface.of(lattice, finer_response(bundle))
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
