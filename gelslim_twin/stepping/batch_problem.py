"""Many independent contacts: what is known of them, and their solution one after the other."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import GelslimError
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.mechanics import StepMechanics
from gelslim_twin.stepping.placement import placed
from gelslim_twin.stepping.step_batch import Drawing, StepBatch
from ifem_export.operators.single_thread import single_threaded

Array = NDArray[np.float64]


@dataclass(eq=False)
class BatchProblem:
    """Contacts to be solved, each from the untouched gel, and what was found of them so far.

    Attributes:
        mechanics: What solves single steps.
        bodies: The k bodies.
        motions: Their rigid motions (n, k, 4, 4).
        errors: Errors of poses, by their number.
    """

    mechanics: StepMechanics
    bodies: tuple[Body, ...]
    motions: Array
    errors: dict[int, GelslimError]
    force_n: Array = field(init=False)
    displacement_mm: Array = field(init=False)
    touch: NDArray[np.int8] = field(init=False)
    large_strain: NDArray[np.bool_] = field(init=False)
    excess: Array = field(init=False)
    one_by_one: NDArray[np.bool_] = field(init=False)

    def __post_init__(self) -> None:
        n, nodes = len(self.motions), len(self.mechanics.points_mm)
        self.force_n = np.zeros((n, nodes, 3))
        self.displacement_mm = np.zeros((n, nodes, 3))
        self.touch = np.zeros((n, nodes), dtype=np.int8)
        self.large_strain = np.zeros(n, dtype=bool)
        self.excess = np.zeros(n)
        self.one_by_one = np.zeros(n, dtype=bool)

    @property
    def top_mm(self) -> float:
        """Height of the highest point of the undeformed gel."""
        return float(self.mechanics.points_mm[:, 2].max())

    def solve_singly(self, number: int) -> None:
        """Solve one pose as a step from the untouched gel does."""
        mechanics, rest = self.mechanics, self.mechanics.rest
        self.one_by_one[number] = True
        try:
            placement = placed(self.bodies, self.motions[number], None, (0.0, 0.0), self.top_mm)
            solved = rest if placement is None else mechanics.advanced(placement, rest)
        except GelslimError as error:
            self.errors[number] = error
            return
        gel = mechanics.gel_alone(solved.gel, self.bodies[0].layer)
        self.force_n[number], self.displacement_mm[number] = gel.force_n, gel.displacement_mm
        self.touch[number] = gel.touch
        self.large_strain[number], self.excess[number] = solved.large_strain, solved.excess

    def result(self, drawing: Drawing) -> StepBatch:
        """The batch, once every pose is solved or has an error."""
        failed = list(self.errors)
        self.force_n[failed] = self.displacement_mm[failed] = np.nan
        self.touch[failed], self.excess[failed] = 0, np.nan
        return StepBatch(
            points_mm=self.mechanics.points_mm,
            motions=self.motions,
            force_n=self.force_n,
            displacement_mm=self.displacement_mm,
            touch=self.touch,
            large_strain=self.large_strain,
            excess=self.excess,
            errors=dict(sorted(self.errors.items())),
            one_by_one=self.one_by_one,
            request=self.mechanics.request,
            drawing=drawing,
        )


@single_threaded
def solve_one_by_one(problem: BatchProblem) -> None:
    """Solve every pose that has no error yet."""
    for number in range(len(problem.motions)):
        if number not in problem.errors:
            problem.solve_singly(number)
