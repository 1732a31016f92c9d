"""Load steps: equal parts of the way between two poses, halved where one does not converge."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TypeVar

from gelslim_twin.contact.gel_state import ContactError
from gelslim_twin.scene.pose import Pose

State = TypeVar("State")


def even_steps(before: Pose, after: Pose, count: int) -> Iterator[Pose]:
    """`count` equal steps from `before` to `after`; the last pose is `after` itself."""
    yield from (before.blended(after, number / count) for number in range(1, count))
    yield after


def is_stationary(before: Pose, pose: Pose) -> bool:
    """Whether the tool does not move between two poses."""
    return replace(before, time_s=pose.time_s) == pose


def with_halved_steps(
    step: Callable[[State, Pose, Pose], State],
    state: State,
    before: Pose,
    pose: Pose,
    halvings: int,
) -> State:
    """State at `pose` by one step or, where that fails, by two halves of it, recursively.

    Raises ContactError with the reason of the smallest step after `halvings` halvings.
    """
    try:
        return step(state, before, pose)
    except ContactError as error:
        if halvings == 0:
            raise ContactError(
                f"no convergence at t = {pose.time_s:g} s, depth {pose.depth_mm:g} mm, in the "
                f"smallest step tried: {error}",
                error.residual,
            ) from error
    middle, _ = even_steps(before, pose, 2)
    state = with_halved_steps(step, state, before, middle, halvings - 1)
    return with_halved_steps(step, state, middle, pose, halvings - 1)
