"""The last step of a fit with light: normal forces at half the pitch of the nodes.

Forces on the nodes cannot express a pressure that ends between two of them, and are too small as a
whole. Normal forces on the nodes and half way between them can, up to half a step beyond the nodes
that press. Inside the contact the pressure half way between nodes is the mean of that on the nodes
around it; only about the rim is it unknown. These forces are found with tangential forces by one
more linearisation, and go to the nodes with the same resultant and moments. Tangential forces are
on all nodes that bear some of the normal ones. Without those beyond the rim, a part of the shear is
explained by a contact that is deeper, or less deep, by up to a tenth.

The prior is that of the nodes for the same traction, where a node has the area of its part of the
places. The sum over neighbours of squared
differences of a traction in the plane, ∫ |∇t|² dA, does not depend on the pitch; that of squared
tractions grows with the number of places, 4, so that the size of each may be twice as large.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.common_shear import TangentialPrior
from gelslim_force.joint.deepness import traction_sigma
from gelslim_force.joint.finer_pressure import FinerPressure, PressureParts
from gelslim_force.joint.fit_state import FitState, FrameData, GelMotion, SoughtForces
from gelslim_force.joint.light.rows import LightRows
from gelslim_force.joint.normal_equations import NormalEquations
from ifem_export.inverse.newton_within import FreeForces, newton_within

if TYPE_CHECKING:
    from gelslim_force.joint.estimator import JointEstimator

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
_TOLERANCE, _STEPS = 0.05, 8
_SIZES = 2.0
"""Standard deviation of the pressure on a place over that on a node."""


def refined(estimator: JointEstimator, frame: FrameData, nodes: Nodes, state: FitState) -> FitState:
    """The estimate with normal forces at half the pitch; the same one where nothing presses.

    Args:
        estimator: Which found the state, with normal forces at half the pitch.
        frame: The data, with light.
        nodes: (p,) that may press.
        state: An estimate, in which more nodes may press.

    Raises:
        IfemError: The strained law does not converge.
    """
    pressure = estimator.pressure
    if pressure is None or not state.force_n[nodes, 2].any():
        return state
    outside = np.ones(len(estimator.points_mm), dtype=bool)
    outside[nodes] = False
    # The rim of a deep contact is steep.
    ring = 1 if estimator.deepness(state) > 0 else 0
    inner = ~estimator.lattice.widened(outside, ring)
    parts = pressure.parts(nodes, inner)
    return _Refinement(estimator, pressure, nodes, parts).of(frame, state)


@dataclass(frozen=True, eq=False)
class _Refinement:
    """A linearisation with the forces of `parts` unknown, about nodes (n,) that press."""

    estimator: JointEstimator
    pressure: FinerPressure
    pressing: Nodes
    parts: PressureParts

    def of(self, frame: FrameData, state: FitState) -> FitState:
        """The estimate."""
        estimator, pressure, parts = self.estimator, self.pressure, self.parts
        responses, nodes = estimator.responses, parts.nodes
        before = self._before(state)
        start, excess = self._on_nodes(before), estimator.excess(state)
        moved = responses.displacement(nodes, start[nodes]) + excess.moved_mm
        normal = parts.places, parts.normal(before)
        height = pressure.heights(moved[:, 2], (nodes, start[nodes, :2]), normal)
        state = replace(state, relief=estimator.relief_at(moved))
        light = estimator.light_sums(frame, _mask(start, self.pressing), moved, state, height)
        assert light is not None
        heights = pressure.by_force(responses, light.nodes, parts)
        markers = estimator.marker_rows(frame, nodes, moved, start[nodes])
        markers = replace(markers, rows=pressure.in_parts(markers.rows, parts))
        gain = 1 - state.gain, estimator.settings.gain_sigma
        equations = NormalEquations.of(parts.size)
        equations = equations.with_rows(markers.rows, markers.residual, markers.weight)
        equations = self._with_prior(equations.with_light(light, heights, gain), state, before)
        friction = estimator.settings.friction
        push = -np.minimum(np.minimum(start[nodes, 2], state.force_n[nodes, 2]), 0.0)
        found, varied = _solved(equations, before, friction * push)
        force = self._on_nodes(found)
        force[nodes, :2] *= _share_in_cone(force[nodes], friction)[:, None]
        higher = (heights @ (found - before).astype(heights.dtype)).astype(float)
        return FitState(
            force,
            GelMotion(responses, nodes, force[nodes], excess),
            light.gain_after(higher, gain[1]),
            equations,
            self._sought(found, force, varied),
            markers.after(found - before),
            state.unexplained,
            light=LightRows(light, heights, gain[1], None, pressure.surface.interpolation),
            relief=state.relief,
        )

    def _before(self, state: FitState) -> Array:
        """(q + 2p,) unknown forces that are nearest to an estimate on the nodes that may press."""
        parts, held = self.parts, np.zeros_like(state.force_n)
        held[self.pressing] = state.force_n[self.pressing]
        normal = self.pressure.forces(parts.places, held[:, 2])[parts.own]
        return np.concatenate([normal, held[parts.nodes, :2].ravel()])

    def _on_nodes(self, unknown: Array) -> Array:
        """Forces (c, 3) on all nodes by the unknown ones (q + 2p,)."""
        parts, force = self.parts, np.zeros((len(self.estimator.points_mm), 3))
        force[parts.nodes, :2] = unknown[parts.tangential].reshape(-1, 2)
        force[:, 2] = self.pressure.on_nodes(parts.places, parts.normal(unknown))
        return force

    def _sought(self, unknown: Array, force: Array, varied: FreeForces | None) -> SoughtForces:
        """What was sought, with forces found (q + 2p,) that are (c, 3) on all nodes."""
        parts, rigid = self.parts, self.estimator.rigid
        sums = self.pressure.in_parts(rigid[:, parts.nodes].reshape(len(rigid), -1), parts)
        pushes = np.repeat(force[parts.nodes, 2] < 0, 2)
        free = np.concatenate([unknown[: len(parts.own)] < 0, pushes])
        return SoughtForces(sums, free, varied)

    def _with_prior(
        self, equations: NormalEquations, state: FitState, before: Array
    ) -> NormalEquations:
        """With smooth tractions of limited size, for forces `before` (q + 2p,)."""
        from gelslim_force.joint.kernels.finer_kernel import add_smoothness

        estimator, parts, nodes = self.estimator, self.parts, self.parts.nodes
        chosen, young, area = estimator.settings, estimator.youngs_modulus_mpa, estimator.area_mm2
        mean = state.force_n[self.pressing] / area[self.pressing, None]
        sigma = traction_sigma(chosen, estimator.deepness(state), young, mean)
        hessian, slope = equations.hessian.copy(), equations.slope.copy()
        # Inside, a place has a quarter of the area of a node.
        share = self.pressure.between(parts.places, area) / 4
        at, size = self.pressure.surface.lattice.place[parts.places], _SIZES * chosen.normal_stress
        given = sigma.rough_mpa, size * young, parts.source, parts.normal(before), hessian, slope
        add_smoothness(at, share, *given)
        at, borne = estimator.lattice.place[nodes], self.pressure.on_nodes(parts.places, share)
        numbers = parts.tangential.reshape(-1, 2).T
        for own in numbers:
            alone = np.repeat(own[:, None], 4, axis=1)
            given = sigma.rough_mpa, sigma.tangential_mpa, alone, before[own], hessian, slope
            add_smoothness(at, borne[nodes], *given)
        beside = estimator.lattice.adjacent(nodes)
        prior = TangentialPrior(
            numbers, beside, borne[nodes], sigma.rough_mpa, sigma.tangential_mpa
        )
        push, found = -self._on_nodes(before)[nodes, 2], NormalEquations(hessian, slope)
        contact = nodes, estimator.lattice
        return prior.with_common_shear(found, before, push, sigma.ratio, contact)


def _mask(force: Array, nodes: Nodes) -> NDArray[np.bool_]:
    found = np.zeros(len(force), dtype=bool)
    found[nodes] = True
    return found


def _solved(
    equations: NormalEquations, before: Array, limit: Array
) -> tuple[Array, FreeForces | None]:
    """The forces that fit best within the limits, and what varies freely."""
    given = equations.hessian, equations.slope, before, limit
    gram, slope, force, most = (a.astype(np.float32) for a in given)
    _, varied = newton_within(gram, slope, force, most, _TOLERANCE, _STEPS)
    return force.astype(float), varied


def _share_in_cone(force_n: Array, friction: float) -> Array:
    """(p,) share of the tangential forces of (p, 3) that friction can bear."""
    size = np.hypot(force_n[:, 0], force_n[:, 1])
    most = friction * np.maximum(-force_n[:, 2], 0.0)
    return np.asarray(np.minimum(1.0, most / np.maximum(size, 1e-300)))
