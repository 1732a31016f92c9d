"""Contact forces that explain the markers and the light of a frame, without a known shape.

Nodal forces on the region where the light changed are fitted to the motion of the markers in the
picture and to the change of the light. A marker shows height too, as the camera looks at the gel
at an angle; light shows the slope. The forces push, keep within a friction cone, and their
traction is smooth. The model is linearised at the last estimate and solved again a few times; the
nodes that hardly press are then removed, and the rest is solved again. Without light, the region
and the forces follow from the markers alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gelslim_force.joint.common_shear import TangentialPrior
from gelslim_force.joint.deepness import (
    deepness,
    least_pressure_at,
    light_share_at,
    traction_sigma,
)
from gelslim_force.joint.finer_pressure import FinerPressure
from gelslim_force.joint.finer_surface import FinerSurface
from gelslim_force.joint.fit_state import FitState, FrameData, GelMotion, JointForces, SoughtForces
from gelslim_force.joint.light.rows import LightRows
from gelslim_force.joint.light.sums import LightSums, placed_bins
from gelslim_force.joint.light.view import LightView, SeenLight
from gelslim_force.joint.markers.rows import MarkerRows, rms_length
from gelslim_force.joint.markers.taken_drift import TakenDrift
from gelslim_force.joint.model_errors import edge_nodes, wrench_spread
from gelslim_force.joint.moved_region import MovedRegion
from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.node_relief import NodeRelief
from gelslim_force.joint.normal_equations import TOLERANCE, Linearised, NormalEquations
from gelslim_force.joint.off_design import OffDesign
from gelslim_force.joint.region import contact_nodes, pressing_nodes
from gelslim_force.joint.responses import Responses
from gelslim_force.joint.rounds import Steps, finished, solutions
from gelslim_force.joint.settings import JointSettings
from gelslim_force.joint.strained_gel import Excess, StrainedGel
from gelslim_force.motion.marker_motion import MarkerRays, MarkerView
from gelslim_force.tracking.drift_filter import FrameDrift
from ifem_export.operators.adjoint_fields import rigid_motions

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Nodes = NDArray[np.intp]
_MARKER_LIMIT = 3.0
"""Standard deviations beyond which a marker counts linearly."""
_LEAST_NODES, _CLOSE = 3, 1
"""The latter: steps about the contact within which heights at half the pitch count."""
_ROUGH_TOLERANCE = 2e-4  # of forces on the nodes that those at half the pitch follow


@dataclass(frozen=True, eq=False)
class JointEstimator:
    """Estimates forces on one pad.

    Attributes:
        points_mm: (c, 3) surface nodes at rest.
        area_mm2: (c,) their shares of the surface.
        neighbours: (c, c) with 1 where nodes share an edge of a cell.
        lattice: Their lattice.
        responses: Of markers and heights to nodal forces.
        markers: The followed markers as seen at rest.
        nodes_to_markers: (n, c) interpolation.
        bending: (n, c) what cubic interpolation adds to it.
        marker_node: (n,) the node nearest to each marker.
        by_height: (n, 2) lateral motion that a picture shows per mm less of the marker's height.
        light: The bins of the picture; None where the markers alone are used.
        youngs_modulus_mpa: Of the gel.
        settings: What is assumed.
        moved: Finds the region where there is no light.
        off_design: What gel and camera that are not as specified do.
        strained: The law of the gel in deep contacts; None for a linear gel.
        relief: What the heights of a dent do to its light; None without directions of light.
        deep_mm: Depth from which a contact is deep.
        finer: The surface between the nodes, as the light sees it; None for cubic convolution.
        pressure: Normal forces at half the pitch; None for those on the nodes alone.
    """

    points_mm: Array
    area_mm2: Array
    neighbours: sparse.csr_array
    lattice: NodeLattice
    responses: Responses
    markers: MarkerView
    nodes_to_markers: Any
    bending: Any
    marker_node: Nodes
    by_height: Array
    light: LightView | None
    youngs_modulus_mpa: float
    settings: JointSettings
    moved: MovedRegion | None = None
    off_design: OffDesign | None = None
    strained: StrainedGel | None = None
    relief: NodeRelief | None = None
    deep_mm: float = math.inf
    finer: FinerSurface | None = None
    pressure: FinerPressure | None = None

    def frame(
        self,
        image: NDArray[np.uint8],
        markers_px: Array,
        noise_px: float,
        drift: FrameDrift | None = None,
    ) -> FrameData:
        """Data of a frame.

        Args:
            image: (h, w, 3) uint8; not looked at without light.
            markers_px: (n, 2) followed markers; NaN for lost ones.
            noise_px: Standard deviation of their positions.
            drift: That the markers are corrected for; None for none.

        Raises:
            LostColourError: The picture is grey where the rest has colour.
        """
        seen = None if self.light is None else self.light.look(image, markers_px)
        taken = None if drift is None else TakenDrift.of(drift, self.markers.mm_per_px)
        return FrameData(seen, MarkerRays(self.markers, markers_px), noise_px, taken)

    def estimate(self, frame: FrameData, last: JointForces | None = None) -> JointForces | None:
        """Forces of a frame, after those of the frame before; None where no contact is seen.

        Raises:
            IfemError: The strained law does not converge.
        """
        return finished(self.steps(frame, last))

    def steps(self, frame: FrameData, last: JointForces | None = None) -> Steps[JointForces | None]:
        """`estimate`, which stops before each solution."""
        region = self._region(frame)
        if region.sum() < _LEAST_NODES:
            return None
        nodes, state = yield from solutions(self, frame, region, last)
        return self._found(frame, region, nodes, state)

    def pressing(self, nodes: Mask, state: FitState) -> Mask:
        """Those of the nodes (c,) that press in an estimate, and what they enclose."""
        pressure = -state.force_n[:, 2] / self.area_mm2
        least = least_pressure_at(self.settings, self.deepness(state))
        return pressing_nodes(nodes, pressure, self.around, self.lattice, least)

    def shown(self, image: NDArray[np.uint8], markers_px: Array) -> Mask:
        """(c,) nodes whose slope the light of a frame shows; arguments and errors as in `frame`."""
        return self._shown(None if self.light is None else self.light.look(image, markers_px))

    def deepness(self, state: FitState) -> float:
        """From 0 to 1, of the contact of an estimate."""
        return deepness(state.near_mm, self.deep_mm)

    @cached_property
    def rigid(self) -> Array:
        """(6, c, 3) whose products with forces are force and torque about the origin."""
        return np.asarray(rigid_motions(self.points_mm))

    def _region(self, frame: FrameData) -> Mask:
        """(c,) nodes that the frame shows as possibly in contact."""
        if self.light is not None and frame.seen is not None:
            rise = self.light.rise(frame.seen)
            return contact_nodes(frame.seen.shading, rise, self.light.place, self.lattice)
        if self.moved is None:
            return np.zeros(len(self.points_mm), dtype=bool)
        lateral = self.markers.lateral_motion(frame.markers.positions_px)
        return self.moved.nodes(lateral, frame.noise_mm, self.settings.marker_mm)

    def solution(self, frame: FrameData, nodes: Nodes, state: FitState) -> FitState:
        """Linearise at the state, and solve for forces on nodes (p,)."""
        return self.solved(self._linearised(frame, nodes, state))

    def _linearised(self, frame: FrameData, nodes: Nodes, state: FitState) -> Linearised:
        """The data near the contact, linear about the state."""
        excess, near = self.excess(state), np.zeros(len(self.points_mm), dtype=bool)
        near[nodes] = True
        moved = state.linear_mm(nodes, near) + excess.moved_mm
        markers = self.marker_rows(frame, nodes, moved, state.force_n[nodes])
        data = NormalEquations.of(3 * len(nodes))
        data = data.with_rows(markers.rows, markers.residual, markers.weight)
        light, heights = self.light_sums(frame, near, moved, state), None
        if light is not None:
            heights = self.responses.of_heights(nodes, light.nodes)
            data = data.with_light(light, heights, (1 - state.gain, self.settings.gain_sigma))
        start, deep = state.force_n[nodes].ravel(), self.deepness(state)
        about = nodes, start, moved, excess, state.gain, deep
        return Linearised(*about, data, markers, light, heights)

    def solved(self, data: Linearised) -> FitState:
        """The forces that the linear data and the prior give."""
        chosen, nodes, young = self.settings, data.nodes, self.youngs_modulus_mpa
        area = self.area_mm2[nodes]
        traction = data.start.reshape(-1, 3) / area[:, None]
        sigma = traction_sigma(chosen, data.deepness, young, traction)
        beside = self.lattice.adjacent(nodes)
        equations = data.equations.with_prior(
            data.start, beside, area, sigma.rough_mpa, chosen.normal_stress * young,
            sigma.tangential_mpa,
        )  # fmt: skip
        along = 3 * np.arange(len(nodes)) + np.array([[0], [1]])
        prior = TangentialPrior(along, beside, area, sigma.rough_mpa, sigma.tangential_mpa)
        push, at = -data.start[2::3], (nodes, self.lattice)
        equations = prior.with_common_shear(equations, data.start, push, sigma.ratio, at)
        tolerance = TOLERANCE if self.pressure is None else _ROUGH_TOLERANCE
        found = equations.solved(data.start, chosen.friction, tolerance)
        force = np.zeros_like(self.points_mm)
        force[nodes] = found.reshape(-1, 3)
        motion = GelMotion(self.responses, nodes, force[nodes], data.excess)
        sums = np.reshape(self.rigid[:, nodes], (6, -1))
        sought = SoughtForces(sums, np.repeat(force[nodes, 2] < 0, 3))
        light, higher = data.light, data.heights_after(found)
        if light is None or higher is None:
            return FitState(force, motion, data.gain, equations, sought, data.markers, 0.0, data)
        gain, left = light.gain_after(higher, chosen.gain_sigma), light.unexplained(higher)
        height = data.moved_mm[light.nodes, 2] + higher
        shown = LightRows(light, data.heights, chosen.gain_sigma, data.free)
        return FitState(
            force, motion, gain, equations, sought, data.markers, left, data, height, light=shown
        )

    def excess(self, state: FitState) -> Excess:
        """What the gel moves further than a linear one in an estimate, after one more step.

        The frame before hands on what it found: a step for its forces would come too late, as the
        first solution of the next frame has others.
        """
        if self.strained is None or state.depth_mm <= self.strained.from_mm:
            return Excess(np.zeros_like(state.force_n))
        if state.equations is None and state.motion.excess.pad is not None:
            return state.motion.excess
        return self.strained.excess(state.displacement_mm, state.force_n, state.motion.excess)

    def marker_rows(
        self, frame: FrameData, nodes: Nodes, moved_mm: Array, force_n: Array
    ) -> MarkerRows:
        """The markers near the contact: lateral motion by the picture and the height.

        What is not resolved: a share of the motion of all, and of each marker's `bending`.

        Args:
            frame: The data.
            nodes: (p,) in contact.
            moved_mm: (c, 3) motion of the surface nodes.
            force_n: (p, 3) forces that cause it.
        """
        from gelslim_force.joint.kernels.fit_kernel import sparse_rows

        chosen = self.settings
        near = np.zeros(len(self.points_mm), dtype=bool)
        near[nodes] = True
        wide = self.lattice.widened(near, chosen.marker_reach)
        used = np.flatnonzero(wide[self.marker_node] & frame.markers.known)
        model, bent = np.empty((2, len(self.markers), 3))
        for matrix, found in ((self.nodes_to_markers, model), (self.bending, bent)):
            sparse_rows(matrix.indptr, matrix.indices, matrix.data, used, moved_mm, found)
        rows = self.responses.of_markers(nodes, used)
        lateral = frame.markers.lateral(used, model[used, 2])
        lateral -= self.responses.beyond_mesh(nodes, force_n, used)
        share = chosen.marker_share * rms_length(model[used])
        errors = math.hypot(chosen.marker_mm, share), chosen.bending_share, _MARKER_LIMIT
        motion = model, bent, self.by_height, frame.noise_mm
        data = MarkerRows.of(used, rows, lateral, motion, errors)
        if frame.taken is None:
            return data
        free = frame.taken.markers
        rows = self.responses.of_markers(nodes, free)
        return frame.taken.off(data, rows, self.shown_motion(free, nodes, moved_mm, force_n))

    def shown_motion(self, markers: Nodes, nodes: Nodes, moved_mm: Array, force_n: Array) -> Array:
        """(k, 2) lateral motion of markers (k,) as a picture shows it; see `marker_rows`."""
        from gelslim_force.joint.kernels.fit_kernel import sparse_rows

        matrix, every = self.nodes_to_markers, np.empty((len(self.markers), 3))
        sparse_rows(matrix.indptr, matrix.indices, matrix.data, markers, moved_mm, every)
        model = every[markers]
        lateral = model[:, :2] - self.by_height[markers] * model[:, 2:]
        return np.asarray(lateral + self.responses.beyond_mesh(nodes, force_n, markers))

    def light_sums(
        self, frame: FrameData, near: Mask, moved_mm: Array, state: FitState, finer_mm: Any = None
    ) -> LightSums | None:
        """The change of light near the contact, linear about the present motion (c, 3).

        It is by the heights of the nodes, or those (f,) of the finer surface if they are given.
        """
        if self.light is None or frame.seen is None:
            return None
        wide = self.lattice.widened(near, self.settings.light_reach)
        relief = self.relief_at(moved_mm) if state.relief is None else state.relief
        finer = None
        if self.finer is not None:
            finer = self.finer.seen(near, moved_mm, state.force_n, finer_mm)
        close = None if finer_mm is None else self.lattice.widened(near, _CLOSE)
        at = self.light, frame.seen, self.lattice, moved_mm, wide
        bins = placed_bins(*at, relief, finer, close)
        share = light_share_at(self.settings, self.deepness(state))
        error = math.hypot(self.settings.light_error, share * rms_length(bins.change.T))
        height = moved_mm[:, 2] if finer_mm is None else finer_mm
        return bins.sums(height, state.gain, error)

    def relief_at(self, moved_mm: Array) -> Array | None:
        """(c, k) light on the surface over that of its slopes alone, for a motion (c, 3)."""
        return None if self.relief is None else self.relief.at_nodes(moved_mm[:, 2])

    @cached_property
    def around(self) -> sparse.csr_array:
        """(c, c) by which a value becomes the mean of those of a node's neighbours."""
        share = 1 / np.maximum(self.neighbours.sum(axis=1), 1)
        return sparse.csr_array(sparse.diags_array(share) @ self.neighbours)

    @cached_property
    def near_edge(self) -> Mask:
        """(c,) nodes at the edge of the gel."""
        return edge_nodes(self.neighbours.sum(axis=1), self.lattice)

    def _found(self, frame: FrameData, seen: Mask, region: Mask, state: FitState) -> JointForces:
        spread = wrench_spread(self, np.flatnonzero(region), state)
        return JointForces(
            state.force_n, state.displacement_mm, region, seen, *spread, state.gain,
            state.unexplained, self._shown(frame.seen), state.motion, state.relief,
        )  # fmt: skip

    def _shown(self, seen: SeenLight | None) -> Mask:
        if self.light is None or seen is None:
            return np.zeros(len(self.points_mm), dtype=bool)
        return self.light.shown(seen, len(self.points_mm))
