"""What a user may choose about the force pipeline; the defaults suit a 90 Hz camera."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, get_args

from gelslim_core.budget.budget import Budget
from gelslim_force.contact.ball_model import BallModel, contact_model
from gelslim_force.contact.indenter import Indenter, Sphere
from gelslim_force.contact.normal_motion import NormalModel
from gelslim_force.forces.contact_forces import ContactForces
from gelslim_force.forces.estimator import ForceEstimator, ForceSettings
from gelslim_force.forces.finite_strain import DepthLaw, FiniteStrainForce, deep_mm, law_of
from gelslim_force.joint.settings import USUAL_GAMMA
from gelslim_force.layer.beyond_mesh import EndlessLayers, NearMotion
from gelslim_force.motion.marker_motion import COMPENSATIONS, Compensation
from gelslim_force.motion.surface_motion import SurfaceMotion
from gelslim_force.tracking.drift_filter import DriftSettings
from ifem_export.bundle.bundle import Bundle
from ifem_export.compliance.contact_columns import ContactCompliance
from ifem_export.errors import IfemError, MeshError
from ifem_export.operators.adjoint_fields import AdjointFields
from ifem_export.operators.surface_operator import RUNGS, Rung, SurfaceOperator

Interpolation = Literal["sparse", "thin_plate"]
Gel = Literal["linear", "neo_hookean", "auto"]
GELS: tuple[Gel, ...] = get_args(Gel)


@dataclass(frozen=True)
class PipelineSettings:
    """Choices of the force pipeline.

    Attributes:
        rung: Surface operator by name; None lets `budget` or the bundle choose.
        budget: Largest error of the forces in the worst contact, or longest time of the operator
            per frame, by which the operator is chosen from the ladder measured in the bundle.
        compensation: How the apparent motion of pressed markers is corrected, see `marker_motion`.
        interpolation: From markers to surface nodes.
        gel: Law of the gel; `auto` takes the neo-Hookean one from a tenth of the thickness on, and
            stays linear for crowned pads and cut cells, which have no neo-Hookean law.
        force: How forces are estimated from the motion.
        noise_px: Standard deviation of a marker's position; None estimates it in each frame.
        unknown_normal_mm: Depth in mm that may remain unnoticed without a normal source. Its
            apparent motion enters the covariance of the wrench.
        least_coverage: Smallest share of the markers seen with which a frame gives forces.
        drift: How drift of the camera against the gel is treated.
        finer_pressure: Whether the forces of an object of unknown shape, by light and markers, are
            fitted at last with normal forces at half the pitch of the nodes. Without it, a frame
            takes 70 % of the time, and normal forces are 2 % too small in the mean.
        gamma: Response of the camera, whose grey values are light^(1/gamma): 1 for a linear one.
            Where forces are those of an unknown shape by light and markers, their gain of the light
            depends on it. A calibrated light has its own.
        check_indenter: Whether a named indenter is compared with the forces of an unknown shape,
            where light and colour allow these.

    Raises:
        ValueError: A value is impossible.
    """

    rung: Rung | None = None
    budget: Budget | None = None
    compensation: Compensation = "exact"
    interpolation: Interpolation = "sparse"
    gel: Gel = "auto"
    force: ForceSettings = field(default_factory=ForceSettings)
    noise_px: float | None = None
    unknown_normal_mm: float = 0.3
    least_coverage: float = 0.3
    drift: DriftSettings = field(default_factory=DriftSettings)
    finer_pressure: bool = True
    gamma: float = USUAL_GAMMA
    check_indenter: bool = True

    def __post_init__(self) -> None:
        if self.rung is not None and self.rung not in RUNGS:
            raise ValueError(f"operator {self.rung!r}: must be one of {', '.join(RUNGS)}")
        if self.rung is not None and self.budget is not None and not self.budget.unlimited:
            raise ValueError("give an operator by name or a budget, not both")
        if self.compensation not in COMPENSATIONS:
            raise ValueError(
                f"compensation {self.compensation!r}: must be one of {', '.join(COMPENSATIONS)}"
            )
        if self.interpolation not in ("sparse", "thin_plate"):
            raise ValueError(f"interpolation {self.interpolation!r}: sparse or thin_plate")
        if self.gel not in GELS:
            raise ValueError(f"gel {self.gel!r}: must be one of {', '.join(GELS)}")
        if self.noise_px is not None and not self.noise_px >= 0:
            raise ValueError(f"noise_px = {self.noise_px:g}: must be >= 0")
        if not 0.2 <= self.gamma <= 5:
            raise ValueError(f"gamma = {self.gamma:g}: must be in 0.2 ... 5")
        if not 0 <= self.least_coverage <= 1:
            raise ValueError(f"least_coverage = {self.least_coverage:g}: must be in 0 ... 1")

    def operator(self, bundle: Bundle) -> SurfaceOperator:
        """Operator of the bundle that these settings ask for.

        Raises BudgetError where no rung keeps the budget, IfemError for a budget without ladder.
        """
        return bundle.surface_operator(self.rung, budget=self.budget)

    def adjoint(self, bundle: Bundle, operator: SurfaceOperator) -> AdjointFields | None:
        """Adjoint fields of the pad; None for the paper's single layer, which is another pad."""
        return None if operator.name == "paper" else bundle.adjoint

    def compliance(self, bundle: Bundle) -> SurfaceOperator:
        """The operator that a masked fit evaluates many times per frame.

        It is the infinite pad's, whose fits far from the edge are as good as exact ones; `edge` is
        for contacts near it. A crowned pad has none: there it is the chosen operator. Raises as
        `operator`.
        """
        try:
            return bundle.surface_operator("fft", lumped=1)
        except IfemError:
            return self.operator(bundle)

    def contact_forces(
        self, bundle: Bundle, operator: SurfaceOperator, motion: SurfaceMotion | None
    ) -> ContactForces:
        """Estimators for contacts in the middle and near the edge. Raises as `operator`."""
        law, adjoint = self.law(bundle, operator), self.adjoint(bundle, operator)
        direct = ForceEstimator(bundle.mesh, operator, self.force, law, motion, adjoint)
        return ContactForces.of(direct, self.compliance(bundle), self.edge(bundle))

    def edge(self, bundle: Bundle) -> ContactCompliance | None:
        """Columns of the compliance for contacts near the edge; None for pads with too many."""
        try:
            return ContactCompliance.shared(bundle)
        except MeshError:
            return None

    def contact(self, bundle: Bundle, indenter: Indenter) -> NormalModel | BallModel:
        """Contact of a known indenter with the pad. Raises as `operator`."""
        # The forces of a ball are those of a layer, and the mesh only tells how the surface moves.
        ball = isinstance(indenter, Sphere)
        near = None if ball else NearMotion.of(EndlessLayers.of(bundle), 0.0)
        points_mm = bundle.mesh.surface_mm
        mesh = NormalModel(self.compliance(bundle), points_mm, self.edge(bundle), near)
        return contact_model(mesh, bundle, indenter)

    def law(self, bundle: Bundle, operator: SurfaceOperator) -> FiniteStrainForce | DepthLaw | None:
        """The law of the gel, where it is not that of the operator alone."""
        if law_of(bundle, self.gel) == "linear":
            return None
        strained = FiniteStrainForce.per_frame(bundle)
        if self.gel == "neo_hookean":
            return strained
        return DepthLaw(operator, strained, deep_mm(bundle))
