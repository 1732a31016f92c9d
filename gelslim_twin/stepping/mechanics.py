"""One step of the gel: which law it needs, and the contact by the solver of that law."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.soft_layer import GelAndLayer, SoftLayer
from gelslim_twin.contact.solver import (
    Candidates,
    ContactSettings,
    ContactSolver,
    Geometry,
    geometry_of,
)
from gelslim_twin.effects.circumstances import EffectParameters
from gelslim_twin.effects.contact import RelaxationParameters
from gelslim_twin.effects.contact_estimate import (
    DEEPEST_SHARE,
    ContactEstimate,
    Footprint,
    contact_estimate,
)
from gelslim_twin.effects.large_strain import NEWTON_RUNGS
from gelslim_twin.scene.pose import Pose
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.placement import Placement
from gelslim_twin.stepping.request import Request
from gelslim_twin.stepping.step_error import StepError
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance

if TYPE_CHECKING:
    from gelslim_twin.contact.nonlinear import NonlinearContact
    from gelslim_twin.contact.prony import PronySeries

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class SolvedStep:
    """The gel after a step.

    Attributes:
        gel: Its state.
        candidates: Candidate nodes of the contact, in the solver's order. Those that were read
            from a file have no compliance yet.
        large_strain: Whether the neo-Hookean law was solved, and not the linear one.
        excess: Estimated share by which a linear gel underestimates the force, where it was used.
    """

    gel: GelState
    candidates: Candidates
    large_strain: bool = False
    excess: float = 0.0


@dataclass(frozen=True)
class Overlap:
    """What of a tool is below the undeformed surface.

    Attributes:
        nodes: Surface nodes that it covers.
        depth_mm: The largest depth.
        depths_mm: Sum of the depths at the nodes.
        span_mm: The larger of the extents of these nodes along x and y.
    """

    nodes: int
    depth_mm: float
    depths_mm: float
    span_mm: float


@dataclass(eq=False)
class StepMechanics:
    """Solves single steps on one sensor. Twins of the same sensor share it.

    Between two calls it keeps nothing that a result depends on.
    """

    compliance: SurfaceCompliance
    request: Request
    friction: float
    effects: Mapping[str, EffectParameters]
    _solver: ContactSolver = field(init=False, repr=False)
    _soft: dict[SoftLayer, ContactSolver] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        geometry = geometry_of(self.compliance.bundle.material.poissons_ratio)
        settings = ContactSettings(self.request.solver_tolerance, self.friction, geometry=geometry)
        self._solver = ContactSolver(self.compliance, Tool(()), settings)
        mesh = self.compliance.bundle.mesh
        self.thickness_mm = mesh.layers * mesh.cell_size_mm[2]
        self._cell_mm2 = mesh.cell_size_mm[0] * mesh.cell_size_mm[1]
        length, width, _ = np.ptp(self.points_mm, axis=0)
        self._pad_mm = float(length), float(width)
        self.top_mm = float(self.points_mm[:, 2].max())

    @property
    def points_mm(self) -> Array:
        """Surface nodes (c, 3) at rest."""
        return self._solver.points_mm

    @property
    def tolerance(self) -> float:
        """Tolerance of the contact with a linear gel."""
        return self._solver.settings.tolerance

    @property
    def geometry(self) -> Geometry:
        """Where the nodes of a linear gel meet a body."""
        return self._solver.settings.geometry

    @property
    def rest(self) -> SolvedStep:
        """The gel without contact."""
        return SolvedStep(GelState.at_rest(len(self.points_mm)), Candidates.none())

    @cached_property
    def _nonlinear(self) -> NonlinearContact:
        from gelslim_twin.contact.nonlinear import NonlinearContact

        # Half of the allowed error is left to the law; Newton's method takes a tenth of that.
        allowed = max(NEWTON_RUNGS[-1][1], 0.1 * self.request.force_share)
        tolerance = next(t for _, t, _ in NEWTON_RUNGS if t <= allowed)
        settings = replace(self._solver.settings, geometry="displaced")
        return NonlinearContact(ContactSolver(self.compliance, Tool(()), settings), tolerance)

    @cached_property
    def series(self) -> PronySeries | None:
        """Relaxation of the gel, None for an elastic one."""
        given = self.effects["relaxation"]
        assert isinstance(given, RelaxationParameters)
        if given.use == "off" or not any(term.fraction for term in given.terms):
            return None
        from gelslim_twin.contact.prony import PronySeries

        return PronySeries(
            tuple(t.fraction for t in given.terms), tuple(t.time_s for t in given.terms)
        )

    def advanced(self, placement: Placement, last: SolvedStep) -> SolvedStep:
        """The gel with the bodies as placed, from the state `last` at the start of the step.

        Raises:
            StepError: The tool goes deeper than the gel allows.
            ContactError: The contact does not converge.
        """
        contact = self._estimate(placement.tool, placement.pose)
        if contact is None:
            return self.rest
        self.require_shallow(placement.name, contact.depth_mm)
        placement.require_no_undercut(self._pad_mm, self.top_mm)
        large_strain = self.needs_large_strain(contact)
        large_strain &= placement.layer is None
        solver = self._nonlinear.solver if large_strain else self._solver_with(placement.layer)
        solver.tool = placement.tool
        solver.candidates = last.candidates
        if len(last.candidates.block) != 3 * len(last.candidates.nodes):
            solver.candidates = Candidates.of(last.candidates.nodes, solver.compliance)
        if large_strain:
            self._nonlinear.forget()
        solve = self._nonlinear if large_strain else solver
        gel = solve.advanced(last.gel, placement.before, placement.pose)
        if not gel.force_n.any():
            return self.rest
        excess = 0.0 if large_strain else contact.nonlinear_excess
        return SolvedStep(gel, solver.candidates, large_strain, excess)

    def gel_alone(self, gel: GelState, layer: SoftLayer | None) -> GelState:
        """The gel of a state that was solved for the motion relative to a body with a layer."""
        if layer is None or not gel.force_n.any():
            return gel
        response = self._solver_with(layer).compliance
        assert isinstance(response, GelAndLayer)
        own = response.layer_motion_mm(np.arange(len(gel.force_n)), gel.force_n)
        return replace(gel, displacement_mm=gel.displacement_mm - own)

    def require_layers_fit(self, bodies: Sequence[Body]) -> None:
        """Raise StepError for a soft layer beside other bodies, or on a gel at large strain."""
        soft = [body.name for body in bodies if body.layer is not None]
        if soft and len(bodies) > 1:
            raise StepError(f"body {soft[0]} has a soft layer and must be the twin's only body")
        if soft and self.effects["nonlinearity"].use == "on":
            raise StepError(
                f"body {soft[0]} has a soft layer, which is linear; nonlinearity must not be on"
            )

    def _solver_with(self, layer: SoftLayer | None) -> ContactSolver:
        if layer is None:
            return self._solver
        if layer not in self._soft:
            response = GelAndLayer.of(self.compliance, layer)
            self._soft[layer] = ContactSolver(response, Tool(()), self._solver.settings)
        return self._soft[layer]

    def tangent_compliance(
        self, solved: SolvedStep, nodes: Nodes, layer: SoftLayer | None = None
    ) -> Array:
        """Compliance (3n, 3n) in mm/N among surface nodes of the gel as it is deformed.

        That of the layer of the body is added.

        Raises ContactError for a gel that only the tool keeps from buckling.
        """
        if solved.large_strain:
            return self._nonlinear.compliance(solved.gel, nodes)
        return self._solver_with(layer).compliance.block(nodes).astype(float)

    def require_shallow(self, name: str, depth_mm: float) -> None:
        """Raise StepError for a body that goes deeper than the gel allows."""
        most = DEEPEST_SHARE * self.thickness_mm
        if depth_mm > most:
            raise StepError(
                f"body {name} goes {depth_mm:.3g} mm deep into a gel of {self.thickness_mm:g} mm, "
                f"the limit is {most:.3g} mm; take shorter time steps, or stop the body before"
            )

    def needs_large_strain(self, contact: ContactEstimate) -> bool:
        """Whether the neo-Hookean law is to be solved for a contact."""
        use = self.effects["nonlinearity"].use
        if use != "auto":
            return use == "on"
        if self.compliance.skin or contact.nonlinear_excess <= self.request.force_share / 2:
            return False
        from gelslim_twin.contact.nonlinear import unfit

        return unfit(self.compliance.bundle) is None

    def _estimate(self, tool: Tool, pose: Pose) -> ContactEstimate | None:
        """The contact from what of the tool is below the undeformed surface; None for nothing."""
        points = self.points_mm
        below = tool.clearance_mm(pose, points)
        into = below < 0
        if not into.any():
            return None
        span = np.ptp(points[into, :2], axis=0)
        return self.estimate(
            Overlap(
                int(into.sum()), -float(below.min()), -float(below[into].sum()), float(span.max())
            )
        )

    def estimate(self, overlap: Overlap) -> ContactEstimate:
        """The contact of a tool that overlaps the undeformed gel."""
        area = self._cell_mm2 * overlap.nodes
        volume = self._cell_mm2 * overlap.depths_mm
        span = overlap.span_mm + float(np.sqrt(self._cell_mm2))
        material = self.compliance.bundle.material
        return contact_estimate(
            Footprint(
                lambda d: area,
                lambda d: volume,
                lambda d: span / 2,
                lambda d: np.inf,
                lambda d: area / span,
            ),
            overlap.depth_mm,
            self.thickness_mm,
            material.youngs_modulus_mpa,
            material.poissons_ratio,
        )
