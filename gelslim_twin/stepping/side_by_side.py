"""Solves many independent contacts side by side with PyTorch.

PyTorch solves rigid bodies without friction on a linear gel. Poses with the same side of the same
body are solved together; what is not of this kind goes to the solver of single steps.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.batch.fields import SolvedContacts
from gelslim_twin.stepping.batch_problem import BatchProblem
from gelslim_twin.stepping.body import Body, Side
from gelslim_twin.stepping.mechanics import Overlap, StepMechanics
from gelslim_twin.stepping.placement import require_no_undercut
from gelslim_twin.stepping.rigid_motion import tool_pose
from gelslim_twin.stepping.step_error import StepError

if TYPE_CHECKING:
    from gelslim_twin.batch.contact import BatchedContact
    from gelslim_twin.batch.engine import Engine

Array = NDArray[np.float64]


def opened_engine(device: str, precision: str) -> Engine:
    """PyTorch on a device. Raises StepError for a device or a precision that it does not have."""
    from gelslim_twin.batch.engine import Engine

    try:
        return Engine.open(device, precision)
    except ValueError as error:
        raise StepError(str(error)) from None


def require_side_by_side(mechanics: StepMechanics, bodies: tuple[Body, ...]) -> None:
    """Raise StepError for what PyTorch does not solve at any pose."""
    if mechanics.friction > 0:
        raise StepError(
            f'backend "torch" solves contact without friction, and friction = '
            f'{mechanics.friction:g}; take backend="numpy", or a twin with friction=0'
        )
    soft = [body.name for body in bodies if body.layer is not None]
    if soft:
        raise StepError(
            f'body {soft[0]} has a soft layer, which backend "torch" does not have; take '
            'backend="numpy"'
        )
    if mechanics.effects["nonlinearity"].use == "on":
        raise StepError(
            'backend "torch" solves a linear gel, and the effect nonlinearity is on; take '
            'backend="numpy", or effects={"nonlinearity": "off"}'
        )


def solve_side_by_side(problem: BatchProblem, contact: BatchedContact) -> None:
    """Solve every pose that has no error yet, together where they have one side of one body."""
    groups: dict[tuple[int, int], tuple[Side, list[int]]] = {}
    for number, (body, side) in _single_sides(problem).items():
        groups.setdefault((body, id(side)), (side, []))[1].append(number)
    for (body, _), (side, numbers) in groups.items():
        _solve_side(problem, contact, body, side, np.array(numbers))


def _single_sides(problem: BatchProblem) -> dict[int, tuple[int, Side]]:
    """Body and side of each pose with one body near the gel; the others are done afterwards."""
    radii = np.array([body.shape.radius_mm for body in problem.bodies])
    near = problem.motions[:, :, 2, 3] - radii <= problem.top_mm
    found: dict[int, tuple[int, Side]] = {}
    for number, close in enumerate(near):
        if number in problem.errors or not close.any():
            continue
        if close.sum() > 1:
            problem.solve_singly(number)
            continue
        body = int(close.argmax())
        try:
            side = problem.bodies[body].side(problem.motions[number, body, :3, :3])
        except StepError as error:
            problem.errors[number] = error
            continue
        found[number] = body, side
    return found


def _solve_side(
    problem: BatchProblem,
    contact: BatchedContact,
    body: int,
    side: Side,
    numbers: NDArray[np.intp],
) -> None:
    """Solve the poses `numbers` (m,) of one side of a body."""
    frames = problem.motions[numbers, body] @ side.frame
    origins, turns = frames[:, :3, 3], frames[:, :3, :3]
    overlaps = contact.overlaps(side.tool, origins, turns)
    together = np.zeros(len(numbers), dtype=bool)
    for at in np.flatnonzero(overlaps.nodes):
        overlap = Overlap(
            int(overlaps.nodes[at]),
            float(overlaps.depth_mm[at]),
            float(overlaps.depths_mm[at]),
            float(overlaps.span_mm[at]),
        )
        together[at] = _is_linear(problem, body, side, frames[at], int(numbers[at]), overlap)
    left = np.flatnonzero(together)
    own, solved = numbers[left], np.zeros(len(problem.motions), dtype=bool)
    into = SolvedContacts(problem.force_n, problem.displacement_mm, problem.touch, solved)
    contact.solve(side.tool, origins[left], turns[left], overlaps.candidates[left], into, own)
    problem.excess[own[~problem.touch[own].any(axis=1)]] = 0.0
    for number in own[~solved[own]]:
        problem.solve_singly(int(number))


def _is_linear(
    problem: BatchProblem, body: int, side: Side, frame: Array, number: int, overlap: Overlap
) -> bool:
    """Whether a pose is left to be solved on a linear gel, after the checks of a step."""
    mechanics, name = problem.mechanics, problem.bodies[body].name
    try:
        estimate = mechanics.estimate(overlap)
        mechanics.require_shallow(name, estimate.depth_mm)
        if side.undercut is not None:
            length, width = np.ptp(mechanics.points_mm[:, :2], axis=0)
            pad_mm = float(length), float(width)
            require_no_undercut(name, side, tool_pose(frame), pad_mm, problem.top_mm)
    except StepError as error:
        problem.errors[number] = error
        return False
    if mechanics.needs_large_strain(estimate):
        problem.solve_singly(number)
        return False
    problem.excess[number] = estimate.nonlinear_excess
    return True
