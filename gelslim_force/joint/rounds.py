"""The solutions of a frame, one after the other, on the nodes that may press.

A new contact is solved for on all nodes seen, and then on those that press. One that the frame
before had is solved for on the nodes that pressed and those next to them. Each function here is a
generator that stops before each solution, so that the work of one frame can be spread over several.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.fit_state import FitState, FrameData, JointForces
from gelslim_force.joint.refinement import refined
from gelslim_force.joint.region import is_new_contact

if TYPE_CHECKING:
    from gelslim_force.joint.estimator import JointEstimator

Mask = NDArray[np.bool_]
Nodes = NDArray[np.intp]
Found = TypeVar("Found")
Steps = Generator[None, None, Found]
"""Stops between steps, and returns what they find."""
Estimate = tuple[Mask, FitState]
"""Nodes (c,) that may press, and the estimate."""
_SETTLED, _FAR, _FAR_ON_LEVEL, _LOST = 0.01, 0.2, 0.35, 0.03
"""Shares of the force. A change below the first one ends the linearisations. One more is needed for
a change since the last frame above the second one, or the third where the surface moved so little
that linear data hold, and if nodes with the last one are left out."""
_HELD_SLOPE, _HELD_BETWEEN = 0.07, 0.19
"""Changes of the surface, over the spacing of the nodes, up to which linear data hold: for contacts
that are not deep, and for forces that another linearisation follows. Forces of 64 random contacts
then differ from those of another linearisation by 0.03 standard deviations in the median, and the
root mean square of their errors against the truth by 2 % at most. Those of deep contacts that move
are as near to converged linearisations as with one more."""


def finished(steps: Steps[Found]) -> Found:
    """What steps find, after all of them."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            found: Found = end.value
            return found


def solutions(
    estimator: JointEstimator, frame: FrameData, region: Mask, last: JointForces | None
) -> Steps[Estimate]:
    """All solutions of a frame.

    Args:
        estimator: Solves.
        frame: The data.
        region: (c,) nodes that the frame shows as possibly in contact.
        last: Forces of the frame before; None without contact.

    Raises:
        IfemError: The strained law does not converge.
    """
    rounds = estimator.settings.rounds
    if last is None or not (last.region & region).any():
        start = FitState.at_rest(estimator.responses, len(estimator.points_mm))
        begun = yield from _rounds(estimator, frame, (region, start), rounds)
    else:
        begun = last.region, last.state
        if is_new_contact(region, last.seen, estimator.lattice):
            begun = yield from _rounds(estimator, frame, (region, begun[1]), rounds)
    nodes = region & estimator.lattice.widened(begun[0], 1)
    return (yield from _last_rounds(estimator, frame, (nodes, begun[1])))


def _last_rounds(estimator: JointEstimator, frame: FrameData, begun: Estimate) -> Steps[Estimate]:
    """`following_rounds`; the last one is at half the pitch where that is asked for."""
    rounds = estimator.settings.following_rounds
    if estimator.pressure is None or frame.seen is None:
        return (yield from _rounds(estimator, frame, begun, rounds))
    nodes, state = begun
    for _ in range(rounds[0]):
        yield
        state = estimator.solution(frame, np.flatnonzero(nodes), state)
    level = _moved_by(estimator, state) <= _HELD_SLOPE
    if is_far := not state.near(begun[1], _FAR_ON_LEVEL if level else _FAR):
        yield
        state = estimator.solution(frame, np.flatnonzero(nodes), state)
    nodes, deep = estimator.pressing(nodes, state), estimator.deepness(state) > 0
    if deep and is_far:
        nodes, state = yield from _rounds(estimator, frame, (nodes, state), rounds[1:])
    elif deep and state.share_beside(nodes) > _LOST:
        yield
        some = np.flatnonzero(nodes)
        held = _held(estimator, state, some, _HELD_BETWEEN)
        state = estimator.solution(frame, some, state) if held is None else held
    yield
    return nodes, refined(estimator, frame, np.flatnonzero(nodes), state)


def _rounds(
    estimator: JointEstimator, frame: FrameData, begun: Estimate, rounds: tuple[int, ...]
) -> Steps[Estimate]:
    """Some solutions on the nodes, and some each time on those of them that press."""
    nodes, state = begun
    wider = None
    for number, count in enumerate(rounds):
        if number > 0:
            wider = state.force_n
            nodes = estimator.pressing(nodes, state)
            held = None
            if not estimator.deepness(state) > 0:
                held = _held(estimator, state, np.flatnonzero(nodes), _HELD_SLOPE)
            if held is not None:
                state, count = held, count - 1
        for _ in range(count):
            yield
            state = estimator.solution(frame, np.flatnonzero(nodes), state)
    state = yield from _settled(estimator, frame, np.flatnonzero(nodes), state)
    return nodes, replace(state, wider_n=wider)


def _held(
    estimator: JointEstimator, state: FitState, nodes: Nodes, most_slope: float
) -> FitState | None:
    """The forces on fewer nodes by the linear data of the last round.

    None where the gel moves so far, by its slope, that these do not hold.
    """
    if state.data is None:
        return None
    data = state.data.on(nodes)
    found = estimator.solved(data)
    if _moved_by(estimator, found) > most_slope:
        return None
    # As in every round, residuals are those of the forces before it.
    return replace(found, markers=data.markers.after(state.force_n[nodes].ravel() - data.start))


def _moved_by(estimator: JointEstimator, state: FitState) -> float:
    """Change of the surface since its data were linearised, over the spacing of the nodes."""
    assert state.data is not None
    moved = np.abs(state.displacement_mm - state.data.moved_mm).max()
    return float(moved / estimator.lattice.step_mm.min())


def _settled(
    estimator: JointEstimator, frame: FrameData, nodes: Nodes, state: FitState
) -> Steps[FitState]:
    """A deep contact after as many more linearisations as it needs."""
    for _ in range(estimator.settings.deep_rounds if estimator.deepness(state) > 0 else 0):
        yield
        before, state = state, estimator.solution(frame, nodes, state)
        if state.near(before, _SETTLED):
            break
    return state
