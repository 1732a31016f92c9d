"""Normal forces at half the pitch, against closed forms and a slow reference."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hertz_on_layer import RADIUS_MM, nodal_forces, true_heights
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from sensor_samples import sensor_bundle

from gelslim_force.joint.finer_pressure import FinerPressure
from gelslim_force.joint.finer_surface import FinerSurface
from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.responses import Responses
from gelslim_force.layer.beyond_mesh import (
    REACH,
    EndlessLayers,
    finer_response,
    half_step_response,
)
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.inverse.contact_fit_kernel import descend_within
from ifem_export.markers.interpolation import marker_to_node

Array = NDArray[np.float64]


@cache
def pressure() -> FinerPressure:
    """On the pad of the tests."""
    bundle = sensor_bundle()
    layers = EndlessLayers.of(bundle)
    points = np.asarray(bundle.mesh.surface_mm)
    nodes = NodeLattice.of(points, np.asarray(bundle.mesh.cell_size_mm[:2]))
    surface = FinerSurface.of(nodes, finer_response(layers))
    return FinerPressure.of(surface, half_step_response(layers))


def places_mm() -> Array:
    """(f, 2) the places."""
    lattice = pressure().surface.lattice
    return np.asarray(lattice.origin_mm + lattice.place * lattice.step_mm)


def test_split_has_the_same_resultant_and_moments() -> None:
    nodes = np.asarray(sensor_bundle().mesh.surface_mm)[:, :2]
    found, rng = pressure(), np.random.default_rng(6)
    places = rng.choice(len(found.corners), 50, replace=False)
    force = rng.normal(size=50)
    split = found.on_nodes(places, force)
    assert split.sum() == pytest.approx(force.sum())
    np.testing.assert_allclose(split @ nodes, force @ places_mm()[places], atol=1e-12)
    np.testing.assert_allclose(
        found.between(places, nodes[:, 0]), places_mm()[places, 0], atol=1e-12
    )


def test_pressure_between_inner_nodes_follows_from_these() -> None:
    """A traction that is linear inside and free at the rim is one of the unknown forces."""
    found, points = pressure(), np.asarray(sensor_bundle().mesh.surface_mm)[:, :2]
    nodes = np.flatnonzero(np.hypot(*points.T) < 2.4)
    inner = np.zeros(len(points), dtype=bool)
    inner[nodes] = True
    parts = found.parts(nodes, inner)
    at = places_mm()[parts.places]
    linear = -1 + 0.1 * at[:, 0] - 0.2 * at[:, 1]
    unknown = np.concatenate([linear[parts.own], np.zeros(2 * len(parts.nodes))])
    np.testing.assert_allclose(parts.normal(unknown), linear, atol=1e-12)
    alone = found.parts(nodes, np.zeros(len(points), dtype=bool))
    assert len(alone.own) == len(alone.places) == len(parts.places)
    assert len(nodes) < len(parts.own) < 0.7 * len(parts.places)


def test_stencils_are_local_and_images_of_each_other() -> None:
    stencils = pressure().stencils
    rim = max(np.abs(stencils[..., [0, -1], :]).max(), np.abs(stencils[..., [0, -1]]).max())
    assert rim < 0.05 * stencils[..., REACH, REACH].min()
    np.testing.assert_allclose(stencils, stencils[..., ::-1, ::-1], atol=1e-9)


def test_hertz_pressure_moves_the_surface_as_the_closed_form_says() -> None:
    """Heights are more than twice as close as by forces on the nodes.

    Slopes at the rim are almost as close as those of the exact heights of the same places.
    """
    found, lattice = pressure(), pressure().surface.lattice
    force = nodal_forces(lattice)[:, 2]
    places = np.flatnonzero(force)
    on_nodes = np.zeros((len(found.surface.place), 3))
    on_nodes[:, 2] = found.on_nodes(places, force[places])
    nodes = np.flatnonzero(on_nodes[:, 2])
    compliance = SurfaceCompliance(sensor_bundle())
    moved = compliance.displacement(nodes, on_nodes[nodes])[:, 2]
    none = np.zeros(0, dtype=np.intp), np.zeros((0, 2))
    heights = found.heights(moved, none, (places, force[places]))
    coarse = found.surface.heights(moved, nodes, on_nodes[nodes])
    rng = np.random.default_rng(2)
    turn, radius = rng.uniform(0, 2 * np.pi, 400), rng.uniform(0.7, 1.3, 400) * RADIUS_MM
    out = np.column_stack([np.cos(turn), np.sin(turn)])
    at, step = radius[:, None] * out, 1e-3 * out
    true = (true_heights(at + step) - true_heights(at - step)) / 2e-3
    taps, exact = lattice.slopes_at(at), true_heights(places_mm())
    near = np.hypot(*places_mm().T) < 1.5 * RADIUS_MM
    off = [np.linalg.norm((h - exact)[near]) for h in (heights, coarse)]
    assert off[0] < 0.5 * off[1]
    half, node, best = (
        np.linalg.norm((taps.slopes(h) * out).sum(axis=1) - true) for h in (heights, coarse, exact)
    )
    assert half < 1.1 * best
    assert half < 0.75 * node


@pytest.mark.parametrize("seed", [0, 1])
def test_heights_by_force_are_those_of_each_force(seed: int) -> None:
    rng, found = np.random.default_rng(seed), pressure()
    points = np.asarray(sensor_bundle().mesh.surface_mm)
    compliance = SurfaceCompliance(sensor_bundle())
    responses = Responses(compliance, marker_to_node(points, points[:3, :2]), np.zeros((3, 2)))
    nodes = np.flatnonzero(np.hypot(*(points[:, :2] - rng.uniform(-2, 2, 2)).T) < 1.2)
    inner = np.zeros(len(points), dtype=bool)
    inner[nodes] = True
    parts = found.parts(nodes, inner)
    unknown, places = rng.normal(size=parts.size), parts.places
    normal, tangential = parts.normal(unknown), unknown[parts.tangential].reshape(-1, 2)
    force = np.zeros_like(points)
    force[parts.nodes, :2] = tangential
    force[:, 2] = found.on_nodes(places, normal)
    bearing = np.flatnonzero(force.any(axis=1))
    moved = compliance.displacement(bearing, force[bearing])[:, 2]
    expected = found.heights(moved, (parts.nodes, tangential), (places, normal))
    near = np.sort(rng.choice(len(expected), 60, replace=False))
    given = found.by_force(responses, near, parts) @ unknown
    np.testing.assert_allclose(given, expected[near], atol=3e-5 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(5))
def test_descent_finds_the_least_squares_within_bounds(seed: int) -> None:
    """Where no tangential force is at its limit, the bounds are those of `lsq_linear`."""
    rng = np.random.default_rng(seed)
    rows, data = rng.normal(size=(60, 14)), rng.normal(size=60)
    upper = np.concatenate([np.zeros(10), np.full(4, np.inf)])
    true = lsq_linear(rows, data, (-np.inf, upper), tol=1e-12).x
    gram, force = rows.T @ rows, -np.ones(14)
    slope = gram @ force - rows.T @ data
    step = 1 / np.linalg.eigvalsh(gram)[-1]
    start = np.minimum(force, upper)
    descend_within(gram, slope, start, np.full(2, 1e3), step, 1e-12, 5000)
    np.testing.assert_allclose(start, true, atol=1e-7)
    limited = force.copy()
    descend_within(gram, slope, limited, np.full(2, 0.01), step, 1e-12, 5000)
    assert np.hypot(*limited[10:].reshape(-1, 2).T).max() <= 0.01 * (1 + 1e-9)
    assert limited[:10].max() <= 0
