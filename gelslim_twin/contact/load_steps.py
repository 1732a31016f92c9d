"""Load stepping: intermediate poses, and steps that are halved where the solver fails."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeVar

from gelslim_twin.contact.contact_error import ContactError
from gelslim_twin.scene.pose import Pose

State = TypeVar("State")
COORDINATES = ("time_s", "x_mm", "y_mm", "depth_mm", "twist_deg", "tilt_x_deg", "tilt_y_deg")


def even_steps(before: Pose, after: Pose, count: int) -> Iterator[Pose]:
    """`count` equal steps from `before` to `after`; the last pose is `after` itself."""
    for number in range(1, count):
        part = number / count
        yield Pose(
            **{
                name: (1 - part) * getattr(before, name) + part * getattr(after, name)
                for name in COORDINATES
            }
        )
    yield after


def is_stationary(before: Pose, pose: Pose) -> bool:
    """Whether the tool does not move between two poses."""
    return all(getattr(before, name) == getattr(pose, name) for name in COORDINATES[1:])


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
