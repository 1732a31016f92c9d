"""Many contacts of one sensor: from poses and a backend to a batch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from gelslim_core.errors import GelslimError
from gelslim_twin.batch.single_drawing import SingleDrawing
from gelslim_twin.stepping.batch_problem import BatchProblem, solve_one_by_one
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.mechanics import StepMechanics
from gelslim_twin.stepping.rigid_motion import batch_motions
from gelslim_twin.stepping.step_batch import StepBatch
from gelslim_twin.stepping.step_error import StepError

if TYPE_CHECKING:
    from gelslim_twin.batch.contact import BatchedContact
    from gelslim_twin.batch.drawing import BatchedDrawing
    from gelslim_twin.simulation.picture import Viewer

BACKENDS = ("numpy", "torch")


@dataclass(frozen=True, eq=False)
class Devices:
    """What one device keeps from batch to batch: compliance, camera and the picture at rest."""

    contact: BatchedContact
    drawing: BatchedDrawing


@dataclass(frozen=True, eq=False)
class BatchSolver:
    """Solves batches on one sensor.

    Attributes:
        mechanics: What solves single steps.
        view: Gives camera and renderer.
    """

    mechanics: StepMechanics
    view: Callable[[], Viewer]
    _kept: dict[tuple[str, str], Devices] = field(default_factory=dict, repr=False)

    def solved(
        self, bodies: tuple[Body, ...], poses: ArrayLike, backend: str, device: str, precision: str
    ) -> StepBatch:
        """The contacts; arguments and errors as of `Twin.batch`."""
        if backend not in BACKENDS:
            raise StepError(f"backend {backend!r}: choose one of {', '.join(BACKENDS)}")
        if not bodies:
            raise StepError("the twin has no body; add one before a batch")
        if self.mechanics.series is not None:
            raise StepError(
                "a batch has no time in which the gel relaxes; take steps, or a twin with "
                'effects={"relaxation": "off"}'
            )
        motions, errors = batch_motions(poses, len(bodies))
        failed: dict[int, GelslimError] = dict(errors)
        problem = BatchProblem(self.mechanics, bodies, motions, failed)
        if backend == "numpy":
            solve_one_by_one(problem)
            return problem.result(SingleDrawing(self.view))
        from gelslim_twin.stepping.side_by_side import require_side_by_side, solve_side_by_side

        require_side_by_side(self.mechanics, bodies)
        devices = self._devices(device, precision)
        solve_side_by_side(problem, devices.contact)
        return problem.result(devices.drawing)

    def _devices(self, device: str, precision: str) -> Devices:
        key = device, precision
        if key not in self._kept:
            from gelslim_twin.batch.contact import BatchedContact
            from gelslim_twin.batch.drawing import BatchedDrawing
            from gelslim_twin.stepping.side_by_side import opened_engine

            engine, mechanics = opened_engine(device, precision), self.mechanics
            contact = BatchedContact(
                engine, mechanics.compliance, mechanics.tolerance, mechanics.geometry
            )
            self._kept[key] = Devices(contact, BatchedDrawing(engine, self.view))
        return self._kept[key]
