"""The last step of a fit with light: normal forces at half the pitch of the nodes.

Forces on the nodes cannot express a pressure that ends between two of them, and are too small as a
whole. Normal forces on the nodes and half way between them can, up to half a step beyond the nodes
that press. They are found with the tangential forces on the nodes by one more linearisation, and
go to the nodes with the same resultant and moments.

The prior is that of the nodes for the same traction. The sum over neighbours of squared
differences of a traction in the plane, ∫ |∇t|² dA, does not depend on the pitch; that of squared
tractions grows with the number of places, 4, so that the size of each may be twice as large.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.deepness import roughness_mpa
from gelslim_force.joint.finer_pressure import in_parts
from gelslim_force.joint.fit_state import FitState, FrameData, GelMotion
from gelslim_force.joint.normal_equations import NormalEquations

if TYPE_CHECKING:
    from gelslim_force.joint.estimator import JointEstimator

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
_MARGIN = 1.05
_TOLERANCE, _STEPS = 1e-4, 400
_SIZES = 2.0
"""Standard deviation of the pressure on a place over that on a node."""


def refined(estimator: JointEstimator, frame: FrameData, nodes: Nodes, state: FitState) -> FitState:
    """The estimate with normal forces at half the pitch; the same one without light.

    Its equations, and with them the covariance, remain those of forces on the nodes.

    Args:
        estimator: Which found the state.
        frame: The data.
        nodes: (p,) that may press.
        state: The estimate on these nodes.

    Raises:
        IfemError: The strained law does not converge.
    """
    pressure, responses = estimator.pressure, estimator.responses
    if pressure is None or frame.seen is None or not state.force_n[nodes, 2].any():
        return state
    places = pressure.about(nodes)
    split = pressure.split[places]
    bearing = np.unique(np.concatenate([split.indices, nodes]))
    near = np.zeros((2, len(state.force_n)), dtype=bool)
    near[0, nodes] = near[1, bearing] = True

    def on_nodes(normal: Array, tangential: Array) -> Array:
        force = np.zeros_like(state.force_n)
        force[nodes, :2] = tangential
        force[:, 2] = split.T @ normal
        return force

    normal = pressure.forces(places, state.force_n[:, 2])
    tangential = state.force_n[nodes, :2]
    start, offset = on_nodes(normal, tangential), estimator.offset(state)
    moved = responses.displacement(bearing, start[bearing]) + offset
    height = pressure.heights(moved[:, 2], (nodes, tangential), (places, normal))
    light = estimator.light_sums(frame, near[0], moved, state, height)
    assert light is not None
    heights = pressure.by_force(responses, light.nodes, nodes, places)
    markers = estimator.marker_rows(frame, near[1], moved)
    rows = in_parts(markers.rows, split[:, bearing], np.searchsorted(bearing, nodes))
    gain = 1 - state.gain, estimator.settings.gain_sigma
    equations = NormalEquations.of(rows.shape[1])
    equations = equations.with_rows(rows, markers.residual, markers.weight)
    before = np.concatenate([normal, tangential.ravel()])
    equations = _with_prior(
        equations.with_light(light, heights, gain), estimator, nodes, places, state, before
    )
    friction = estimator.settings.friction
    limit = friction * np.maximum(-state.force_n[nodes, 2], 0.0)
    found = _solved(equations, before, limit)
    gained = light.gain_after(heights @ (found - before).astype(heights.dtype), gain[1])
    normal, tangential = found[: len(places)], found[len(places) :].reshape(-1, 2)
    force = on_nodes(normal, tangential)
    force[nodes, :2] *= _share_in_cone(force[nodes], friction)[:, None]
    motion = GelMotion(responses, bearing, force[bearing], offset)
    return replace(state, force_n=force, motion=motion, gain=gained, height_mm=None)


def _with_prior(
    equations: NormalEquations,
    estimator: JointEstimator,
    nodes: Nodes,
    places: Nodes,
    state: FitState,
    before: Array,
) -> NormalEquations:
    """With smooth tractions of limited size, for forces `before` (q + 2p,)."""
    pressure, chosen = estimator.pressure, estimator.settings
    assert pressure is not None
    young, area = estimator.youngs_modulus_mpa, estimator.area_mm2
    mean = -state.force_n[nodes, 2] / area[nodes]
    rough = roughness_mpa(chosen, estimator.deepness(state), young, mean)
    # Inside, a place has a quarter of the area of a node.
    finer = pressure.split[places] @ area / 4
    adjacent = pressure.surface.lattice.adjacent(places)
    prior, count = np.zeros_like(equations.hessian), len(places)
    prior[:count, :count] = _smooth(adjacent, finer, rough, _SIZES * chosen.normal_stress * young)
    size = chosen.tangential_stress * young
    for axis in (0, 1):
        own = slice(count + axis, None, 2)
        prior[own, own] = _smooth(estimator.lattice.adjacent(nodes), area[nodes], rough, size)
    return NormalEquations(equations.hessian + prior, equations.slope + prior @ before)


def _smooth(adjacent: Array, area_mm2: Array, rough_mpa: float, size_mpa: float) -> Array:
    """(n, n) of tractions whose neighbours, marked in (n, n), differ by `rough_mpa`."""
    laplacian = np.diag(adjacent.sum(axis=1)) - adjacent
    found = laplacian / rough_mpa**2 + np.eye(len(adjacent)) / size_mpa**2
    return np.asarray(found / np.outer(area_mm2, area_mm2))


def _solved(equations: NormalEquations, before: Array, limit: Array) -> Array:
    from gelslim_force.joint.finer_kernel import descend
    from ifem_export.inverse.contact_fit_kernel import largest_eigenvalue

    gram, slope, force, most = (
        a.astype(np.float32) for a in (equations.hessian, equations.slope, before, limit)
    )
    step = np.float32(1.0 / (_MARGIN * largest_eigenvalue(gram)))
    descend(gram, slope, force, most, step, _TOLERANCE, _STEPS)
    return force.astype(float)


def _share_in_cone(force_n: Array, friction: float) -> Array:
    """(p,) share of the tangential forces of (p, 3) that friction can bear."""
    size = np.hypot(force_n[:, 0], force_n[:, 1])
    most = friction * np.maximum(-force_n[:, 2], 0.0)
    return np.asarray(np.minimum(1.0, most / np.maximum(size, 1e-300)))
