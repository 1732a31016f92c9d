"""Which nodes of a region press: each contact by its own pressure."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.region import pressing_nodes

Array = NDArray[np.float64]
X, Y = 0.8 * np.arange(20), 0.8 * np.arange(10)
LEAST = 0.3


def places() -> Array:
    return np.column_stack([a.ravel() for a in np.meshgrid(X, Y, indexing="ij")])


def dome(middle_mm: tuple[float, float], radius_mm: float, most: float) -> Array:
    away = ((places() - middle_mm) ** 2).sum(axis=1) / radius_mm**2
    return most * np.sqrt(np.maximum(1 - away, 0.0))


def pressing(pressure: Array, region: Array) -> NDArray[np.bool_]:
    points = places()
    apart = np.abs(points[:, None] - points).sum(axis=2)
    beside = (apart > 0.1) & (apart < 0.9)
    around = sparse.csr_array(beside / beside.sum(axis=1, keepdims=True))
    lattice = NodeLattice.of(np.column_stack([points, 0 * points[:, 0]]), np.array([0.8, 0.8]))
    return pressing_nodes(region, pressure, around, lattice, LEAST)


def test_a_fainter_contact_stays_although_weak_nodes_join_it_to_a_strong_one() -> None:
    """By the mean pressure of both it lost a quarter of its force, and then all of it."""
    strong, faint = dome((4.0, 4.0), 2.6, 1.0), dome((10.4, 4.0), 2.6, 0.32)
    bridge = np.where((strong + faint) == 0, 0.02, 0.0)
    kept = pressing(strong + faint + bridge, np.ones(len(strong), dtype=bool))
    assert kept[faint > 0.1].all()
    assert faint[kept].sum() > 0.9 * faint.sum()
    assert not kept[bridge > 0].any()


def test_what_presses_much_less_than_all_is_left_out() -> None:
    strong = dome((4.0, 4.0), 2.6, 1.0)
    noise = np.where(strong > 0, 0.0, 0.05)
    kept = pressing(strong + noise, np.ones(len(strong), dtype=bool))
    assert not kept[dome((4.0, 4.0), 3.5, 1.0) == 0].any()
    assert kept[strong > 0.5].all()


def test_where_nothing_presses_the_region_stays() -> None:
    region = dome((4.0, 4.0), 2.6, 1.0) > 0
    np.testing.assert_array_equal(pressing(0.0 * region, region), region)
