"""The bodies that are near the gel, placed as one tool of the contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.soft_layer import SoftLayer
from gelslim_twin.scene.pose import Pose
from gelslim_twin.stepping.body import Body, Side
from gelslim_twin.stepping.rigid_motion import tool_pose
from gelslim_twin.stepping.step_error import StepError
from gelslim_twin.tools.tool import Tool
from gelslim_twin.tools.tool_group import GroupPose, ToolGroup, members_of

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Placement:
    """Bodies near the gel at the end of a step.

    Attributes:
        bodies: Their numbers among all bodies.
        sides: The side of each that faces the gel.
        tool: The sides as one tool.
        pose: Its pose at the end of the step.
        before: Its pose at the start; None for the first step.
        names: Name of each body.
        layer: The soft layer of the body, which is the only one then; None for rigid bodies.
    """

    bodies: tuple[int, ...]
    sides: tuple[Side, ...]
    tool: Tool
    pose: Pose
    before: Pose | None
    names: tuple[str, ...]
    layer: SoftLayer | None = None

    @property
    def name(self) -> str:
        """Names of the bodies in one."""
        return " and ".join(self.names)

    def require_no_undercut(self, pad_mm: tuple[float, float], top_mm: float) -> None:
        """Raise StepError where the gel meets a part of a body that is hidden behind a gap.

        Args:
            pad_mm: Length and width of the pad.
            top_mm: Height of the highest point of the undeformed gel.
        """
        for name, side, pose in zip(self.names, self.sides, members_of(self.pose), strict=True):
            require_no_undercut(name, side, pose, pad_mm, top_mm)

    def owners(self, places_mm: Array) -> NDArray[np.intp]:
        """Numbers (n,) of the bodies that points (n, 3) of the deformed surface belong to."""
        if isinstance(self.tool, ToolGroup):
            return np.asarray(self.bodies, dtype=np.intp)[self.tool.owners(self.pose, places_mm)]
        return np.full(len(places_mm), self.bodies[0], dtype=np.intp)


def require_no_undercut(
    name: str, side: Side, pose: Pose, pad_mm: tuple[float, float], top_mm: float
) -> None:
    """The same for one body, by its name, its side and the pose of that side.

    Raises:
        StepError: The gel meets an undercut.
    """
    met = None if side.undercut is None else side.undercut.below(pose, pad_mm, top_mm)
    if met is not None:
        raise StepError(
            f"body {name}: the gel meets an undercut, hidden from below by other parts: {met}; "
            "turn the body, press less deep, or fill the gap in the mesh"
        )


def placed(
    bodies: Sequence[Body],
    motions: Array,
    before: Array | None,
    times_s: tuple[float, float],
    top_mm: float,
) -> Placement | None:
    """Place bodies over the gel.

    Args:
        bodies: All bodies.
        motions: Their rigid motions (k, 4, 4) at the end of the step.
        before: The same at its start; None for the first step.
        times_s: Start and end of the step.
        top_mm: Height of the highest point of the undeformed gel.

    Returns:
        The bodies that reach below that height by the sphere around them; None where none does.

    Raises:
        StepError: A body has no side that faces the gel.
    """
    near = tuple(
        number
        for number, body in enumerate(bodies)
        if motions[number, 2, 3] - body.shape.radius_mm <= top_mm
    )
    if not near:
        return None
    sides = tuple(bodies[k].side(motions[k, :3, :3]) for k in near)

    def poses(moved: Array, time_s: float) -> list[Pose]:
        return [tool_pose(moved[k] @ s.frame, time_s) for k, s in zip(near, sides, strict=True)]

    ends, starts = poses(motions, times_s[1]), None
    if before is not None:
        pairs = zip(poses(before, times_s[0]), ends, strict=True)
        starts = [_turned_to(start, end) for start, end in pairs]
    tools = tuple(side.tool for side in sides)
    return Placement(
        near,
        sides,
        tools[0] if len(tools) == 1 else ToolGroup((), tools),
        _joined(ends, times_s[1]),
        None if starts is None else _joined(starts, times_s[0]),
        tuple(bodies[k].name for k in near),
        bodies[near[0]].layer,
    )


def _joined(poses: list[Pose], time_s: float) -> Pose:
    return poses[0] if len(poses) == 1 else GroupPose.of(time_s, tuple(poses))


def _turned_to(start: Pose, end: Pose) -> Pose:
    """The same pose with its angles within half a turn of those at the end of the step.

    The load steps between the two take the angles in equal parts, which must not lead once round.
    """
    nearer = {
        name: getattr(start, name) + 360 * round((getattr(end, name) - getattr(start, name)) / 360)
        for name in ("twist_deg", "tilt_y_deg")
    }
    return replace(start, **nearer)
