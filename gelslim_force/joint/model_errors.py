"""What the model leaves out of the forces of an unknown shape, as covariance of their wrench."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.settings import JointSettings

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_EDGE_STEPS = 2


def edge_nodes(neighbour_count: NDArray[np.float64], lattice: NodeLattice) -> Mask:
    """(c,) nodes within two steps of the edge of the gel, by the number of their neighbours."""
    return lattice.widened(np.asarray(neighbour_count < 4), _EDGE_STEPS)


def at_edge(force_n: Array, points_mm: Array, near: Mask, settings: JointSettings) -> Array:
    """(6, 6) by what the mesh does not resolve of contacts at the edge of the gel.

    Args:
        force_n: (c, 3) nodal forces.
        points_mm: (c, 3) places of the nodes.
        near: (c,) nodes at the edge.
        settings: Has the share.
    """
    force, places = force_n[near], points_mm[near]
    push = np.abs(force[:, 2])
    if not push.any():
        return np.zeros((6, 6))
    x, y = push @ places[:, :2] / push.sum()
    along = np.array([[1.0, 0, 0, 0, 0, -y], [0, 1.0, 0, 0, 0, x], [0, 0, 1.0, y, -x, 0]])
    size = settings.edge_share * float(np.linalg.norm(force.sum(axis=0)))
    return np.asarray(size**2 * along.T @ along)


def by_heights(by_marker: Array, mm_per_px: Array, apparent_mm: Array) -> Array:
    """(6, 6) by an error of the heights that all markers in a dent have in common.

    The camera looks at the gel at an angle, so that markers at wrong heights seem to have moved
    aside, all to the same side: a shear without a force.

    Args:
        by_marker: (6, n, 2) change of the wrench per px by which a marker is seen elsewhere.
        mm_per_px: (n, 2, 2) of the markers.
        apparent_mm: (n, 2) lateral motion that the picture shows of a standard deviation of theirs.
    """
    seen_px = np.linalg.solve(mm_per_px, apparent_mm[:, :, None])[:, :, 0]
    change = np.einsum("anj,nj->a", by_marker, seen_px)
    return np.outer(change, change)


def by_region(rigid: Array, force_n: Array, wider_n: Array | None) -> Array:
    """(6, 6) by a region that is not known better than its last change.

    Args:
        rigid: (6, c, 3) whose products with forces are force and torque.
        force_n: (c, 3) nodal forces.
        wider_n: The same before nodes that hardly press were removed the last time; None where
            none were.
    """
    if wider_n is None:
        return np.zeros((6, 6))
    change = np.einsum("kcd,cd->k", rigid, force_n - wider_n)
    return np.outer(change, change)
