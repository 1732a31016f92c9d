"""The result of one step: forces at once, pictures and derivatives when they are asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.wrench import resultant
from gelslim_twin.contact.gel_state import AnchoredState, GelState
from gelslim_twin.stepping.mechanics import SolvedStep, StepMechanics
from gelslim_twin.stepping.placement import Placement
from gelslim_twin.stepping.request import Request

if TYPE_CHECKING:
    from gelslim_twin.render.frame_renderer import RenderedFrame
    from gelslim_twin.simulation.picture import Viewer

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Step:
    """The gel after one step.

    Attributes:
        time_s: Time since the start.
        step_s: Length of the step.
        number: Steps since the start.
        points_mm: Surface nodes (c, 3) at rest.
        gel: State of the gel, with the forces after relaxation.
        solved: The elastic gel, before relaxation, and the law that was solved.
        before: State of the gel before the step, for motion blur.
        motions: Rigid motions (k, 4, 4) of the bodies.
        placement: The bodies near the gel; None where none is.
        request: What the twin was asked for.
        mechanics: What solved the step.
        view: Gives camera and renderer.
    """

    time_s: float
    step_s: float
    number: int
    points_mm: Array
    gel: GelState
    solved: SolvedStep
    before: GelState
    motions: Array
    placement: Placement | None
    request: Request
    mechanics: StepMechanics
    view: Callable[[], Viewer]

    @property
    def force_n(self) -> Array:
        """Nodal forces (c, 3) in N on the gel."""
        return self.gel.force_n

    @property
    def displacement_mm(self) -> Array:
        """Displacement (c, 3) of the surface nodes."""
        return self.gel.displacement_mm

    @property
    def large_strain(self) -> bool:
        """Whether the neo-Hookean law was solved, and not the linear one."""
        return self.solved.large_strain

    @property
    def excess(self) -> float:
        """Estimated share by which a linear gel underestimates the force, where it was used."""
        return self.solved.excess

    @property
    def in_contact(self) -> bool:
        """Whether a body touches the gel."""
        return bool(self.gel.touch.any())

    @cached_property
    def wrench(self) -> Array:
        """Force in N and torque in N mm (6,) on the gel about the origin of the sensor.

        As everywhere in this project, the nodal forces act at the nodes at rest.
        """
        return np.concatenate(resultant(self.points_mm, self.gel.force_n))

    @cached_property
    def reactions(self) -> Array:
        """Force in N and torque in N mm (k, 6) on each body about its origin, sensor frame.

        They act where the nodes are now. This is what a physics engine applies to the bodies: its
        work over a closed path without friction is zero. The force of a node is that of the body
        on whose surface it lies.
        """
        found = np.zeros((len(self.motions), 6))
        if self.placement is None:
            return found
        pushed = np.flatnonzero(self.gel.force_n.any(axis=1))
        places = (self.points_mm + self.gel.displacement_mm)[pushed]
        owners = self.placement.owners(places)
        for body in self.placement.bodies:
            own = owners == body
            arms = places[own] - self.motions[body, :3, 3]
            found[body] = -np.concatenate(resultant(arms, self.gel.force_n[pushed[own]]))
        return found

    @cached_property
    def stiffness(self) -> Array:
        """Derivative (6, 6 k) of the wrench by the poses of the k bodies.

        A row is a component of `wrench`. The columns of each body are its translation in mm and its
        rotation in rad about its own origin, in the sensor frame. The contact set is that of the
        step: nodes stay in contact, stick or slip as they do. Where a step took several load steps,
        it is the derivative of the last of them. The gel does not relax meanwhile.

        Raises ContactError for a gel that only the body keeps from buckling.
        """
        found = np.zeros((6, 6 * len(self.motions)))
        gel = self.solved.gel
        if self.placement is None or not isinstance(gel, AnchoredState) or gel.touched is None:
            return found
        from gelslim_twin.stepping.derivative import wrench_derivative

        return wrench_derivative(
            self.points_mm,
            gel,
            self.mechanics.tangent_compliance(self.solved, gel.touched.nodes, self.placement.layer),
            self.placement,
            self.motions,
            self.mechanics.friction,
            "displaced" if self.large_strain else self.mechanics.geometry,
        )

    @cached_property
    def markers_px(self) -> Array:
        """Images (m, 2) of the dots' centres. Raises StepError unless they are observed."""
        self.request.require_seen("markers")
        return self.view().markers_px(self.gel)

    @cached_property
    def frame(self) -> RenderedFrame:
        """The picture with the dots drawn in it. Raises StepError unless images are observed."""
        self.request.require_seen("image")
        return self.view().frame(self.gel, self.before, self.number, self.step_s)

    def image(self) -> NDArray[np.uint8]:
        """The picture (h, w, 3), or (h, w) of a mono camera, drawn at the first call.

        Raises StepError unless images are observed.
        """
        return self.frame.image
