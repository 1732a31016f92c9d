"""Covariance of the wrench of an unknown shape: by its data, and by what the model leaves out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.settings import JointSettings
from gelslim_force.joint.variance_components import scaled_covariance

if TYPE_CHECKING:
    from gelslim_force.joint.estimator import JointEstimator
    from gelslim_force.joint.fit_state import FitState

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Nodes = NDArray[np.intp]
_EDGE_STEPS = 2


def wrench_spread(
    estimator: JointEstimator, nodes: Nodes, state: FitState
) -> tuple[Array, Array, Array | None]:
    """`covariance`, `by_marker` and `by_gel` of `JointForces`.

    Args:
        estimator: Which found the state.
        nodes: (p,) in contact.
        state: The estimate.
    """
    equations, sought, markers = state.equations, state.sought, state.markers
    assert equations is not None
    assert sought is not None
    assert markers is not None
    settings, off_design = estimator.settings, estimator.off_design
    probes = markers.probes()
    wanted = np.vstack([sought.sums, probes])
    spread, probed = np.split(sought.spread_of(wanted, equations), [len(sought.sums)])
    covariance = at_edge(state.force_n, estimator.points_mm, estimator.near_edge, settings)
    by_motion, height = markers.by_motion(spread), state.displacement_mm[:, 2]
    by_marker = markers.response(by_motion, estimator.markers.mm_per_px)
    dent = estimator.nodes_to_markers @ height
    apparent = settings.height_share * estimator.by_height * dent[:, None]
    apparent *= min(-float(dent.min(initial=0.0)) / estimator.deep_mm, 1.0)
    covariance += by_heights(by_motion, apparent[markers.used])
    by_gel = None
    if off_design is not None:
        data = markers.used, by_motion, state.light, spread
        by_gel = off_design.by_parameter(*data, state.force_n)
    if estimator.light is not None:
        determined = markers.determined(probes, probed)
        covariance += spread @ sought.sums.T - markers.overstated(by_motion, determined)
        return covariance, by_marker, by_gel
    force = state.force_n[nodes]
    covariance += scaled_covariance(equations.hessian, markers, sought.sums, spread, force.ravel())
    covariance += by_region(estimator.rigid, state.force_n, state.wider_n)
    if off_design is not None:
        covariance += off_design.by_camera(markers.used, by_motion, height)
    return covariance, by_marker, by_gel


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


def by_heights(by_motion: Array, apparent_mm: Array) -> Array:
    """(6, 6) by an error of the heights that all markers in a dent have in common.

    The camera looks at the gel at an angle, so that markers at wrong heights seem to have moved
    aside, all to the same side: a shear without a force.

    Args:
        by_motion: (6, m, 2) change of the wrench per mm by which a marker is seen elsewhere.
        apparent_mm: (m, 2) lateral motion that the picture shows of a standard deviation of theirs.
    """
    change = np.einsum("amj,mj->a", by_motion, apparent_mm)
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
