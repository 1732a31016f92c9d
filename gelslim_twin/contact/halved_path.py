"""Poses between two poses, and going to a pose in halves where one step does not get there."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeVar

from gelslim_twin.contact.contact_error import ContactError
from gelslim_twin.scene.pose import Pose

State = TypeVar("State")
COORDINATES = ("time_s", "x_mm", "y_mm", "depth_mm", "twist_deg", "tilt_x_deg", "tilt_y_deg")


def between(before: Pose, after: Pose, count: int) -> Iterator[Pose]:
    """The `count` poses of an even path from `before`, left out, to `after`, to the bit."""
    for number in range(1, count):
        part = number / count
        yield Pose(
            **{
                name: (1 - part) * getattr(before, name) + part * getattr(after, name)
                for name in COORDINATES
            }
        )
    yield after


def rests(before: Pose, pose: Pose) -> bool:
    """Whether the tool stays where it is: without motion, contact changes nothing."""
    return all(getattr(before, name) == getattr(pose, name) for name in COORDINATES[1:])


def reached(
    step: Callable[[State, Pose, Pose], State],
    state: State,
    before: Pose,
    pose: Pose,
    halvings: int,
) -> State:
    """State at `pose`, by one step or, where that raises, by halves of it.

    Raises ContactError with the last step's reason where `halvings` are not enough.
    """
    try:
        return step(state, before, pose)
    except ContactError as error:
        if halvings == 0:
            raise ContactError(
                f"no contact at t = {pose.time_s:g} s, depth {pose.depth_mm:g} mm, in the "
                f"smallest step tried: {error}",
                error.residual,
            ) from error
    middle, _ = between(before, pose, 2)
    state = reached(step, state, before, middle, halvings - 1)
    return reached(step, state, middle, pose, halvings - 1)
