"""The proof that a finger goes together: every way is free, and a driver reaches every screw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gelslim_cad.assembly.bodies import Bodies, Floats
from gelslim_cad.assembly.drivers import Driver
from gelslim_cad.assembly.order import Leg, Step, Vector, Way
from gelslim_cad.assembly.sweep import Surface, first_contact
from gelslim_core.errors import GelslimError

GAPS_MM = (0.05, 0.1, 0.2)
"""Gaps around the moving parts that are tried."""
SEAT_MM = 1.0
"""End of the way, where parts may fit more tightly: in recesses, at stops."""
CORNERS = 24
"""Corners of the circles that stand for the shaft and the handle of a driver."""
TIP_MM = 0.05
"""The driver is taken to end this far before the head, in which its blade stands."""


@dataclass(frozen=True)
class Fixed:
    """Parts that are in place: their names, and their triangles with the number of the part."""

    names: tuple[str, ...]
    surface: Surface

    @classmethod
    def of(cls, bodies: Bodies, names: Sequence[str]) -> Fixed:
        """Parts by their names."""
        return cls(tuple(names), Surface.joined([bodies.corners_mm(name) for name in names]))

    def with_body(self, name: str, bodies: Bodies) -> Fixed:
        """With one more part."""
        return Fixed.of(bodies, (*self.names, name))


@dataclass(frozen=True)
class Block:
    """A way that is not free.

    Attributes:
        moving: Part, or driver, that cannot pass.
        fixed: Part that is in its way.
        short_mm: Rest of the way that is left.
        point_mm: Where they meet, in the sensor frame.
        way: The way that was tried.
    """

    moving: str
    fixed: str
    short_mm: float
    point_mm: Vector
    way: Way


class AssemblyBlockedError(GelslimError):
    """A step for which no way is free.

    Attributes:
        step: Key of the step.
        number: Its number in the order.
        block: Where its first way ends.
        tried: Number of ways that were tried.
    """

    exit_status = 1
    kind = "assembly blocked"

    def __init__(self, step: str, number: int, block: Block, tried: int) -> None:
        super().__init__(blocked_sentence(step, number, block, tried))
        self.step, self.number, self.block, self.tried = step, number, block, tried

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        return type(self), (self.step, self.number, self.block, self.tried)

    def to_dict(self) -> dict[str, object]:
        """Step, pair, place and rest of the way as data."""
        return super().to_dict() | {
            "step": self.step,
            "step_number": self.number,
            "moving": self.block.moving,
            "fixed": self.block.fixed,
            "short_mm": self.block.short_mm,
            "point_mm": list(self.block.point_mm),
            "ways_tried": self.tried,
        }


def blocked_sentence(step: str, number: int, block: Block, tried: int) -> str:
    """Say which pair blocks a step, where, and how far it gets."""
    x, y, z = block.point_mm
    rest = f"it stays {block.short_mm:.2f} mm short of its place"
    others = (
        f"none of {tried} directions that were tried is free"
        if tried > 1
        else "there is no other way"
    )
    return (
        f"assembly, step {number} ({step}): {block.moving} meets {block.fixed} at "
        f"({x:.2f}, {y:.2f}, {z:.2f}) mm; {rest}; {others}"
    )


@dataclass(frozen=True)
class ProvenStep:
    """A step whose way is free.

    Attributes:
        step: The step.
        way: The way that was found.
        gap_mm: Largest of `GAPS_MM` by which all faces of the moving parts can be moved outwards
            and the way stays free up to `SEAT_MM` before its end; 0 where there is none.
        closest: The two parts that would meet with the next larger gap; empty where the largest
            is free.
    """

    step: Step
    way: Way
    gap_mm: float = 0.0
    closest: tuple[str, ...] = ()


def prove(steps: Sequence[Step], bodies: Bodies) -> tuple[ProvenStep, ...]:
    """Prove that the parts come to their places in this order.

    Args:
        steps: The order of assembly.
        bodies: Meshes of the parts.

    Returns:
        The steps, each with the first of its ways that is free.

    Raises:
        AssemblyBlockedError: No way of a step is free, or a driver does not reach a screw.
    """
    return tuple(_proven(number, step, bodies) for number, step in enumerate(steps, start=1))


def _proven(number: int, step: Step, bodies: Bodies) -> ProvenStep:
    ignored = {name for name, _ in step.ignored}
    fixed = Fixed.of(bodies, [name for name in step.stays if name not in ignored])
    way, gap, closest = step.way, 0.0, tuple[str, ...]()
    if step.moves:
        moving = {name: bodies.shrunk_mm(name) for name in step.moves}
        way = _free_way(number, step, moving, fixed)
        gap, closest = _gap(step, bodies, way, fixed)
    fixed = Fixed.of(bodies, [*step.stays, *step.moves])
    for fastener in step.fasteners:
        body = {fastener.part: bodies.shrunk_mm(fastener.part)}
        block = blocked(body, fixed, fastener.way)
        if block is None and fastener.driver is not None:
            block = driver_blocked(bodies, fastener.part, fixed, fastener.way, fastener.driver)
        if block is not None:
            raise AssemblyBlockedError(step.key, number, block, 1)
        fixed = fixed.with_body(fastener.part, bodies)
    return ProvenStep(step, way, gap, closest)


def _free_way(number: int, step: Step, moving: dict[str, Floats], fixed: Fixed) -> Way:
    """The first way of a step that is free."""
    ways = (step.way, *step.others)
    first: Block | None = None
    for way in ways:
        block = blocked(moving, fixed, way)
        if block is None:
            return way
        first = first or block
    assert first is not None
    raise AssemblyBlockedError(step.key, number, first, len(ways))


def _gap(step: Step, bodies: Bodies, way: Way, fixed: Fixed) -> tuple[float, tuple[str, ...]]:
    """Gap around the moving parts on their way, and what limits it."""
    last = way[-1]
    before = (*way[:-1], Leg(last.direction, max(last.length_mm - SEAT_MM, 0.0)))
    back = SEAT_MM * np.asarray(last.direction)
    found = 0.0
    for gap in GAPS_MM:
        grown = {name: bodies.grown_mm(name, gap) - back for name in step.moves}
        block = blocked(grown, fixed, before)
        if block is not None:
            return found, (block.moving, block.fixed)
        found = gap
    return found, ()


def blocked(moving: dict[str, Floats], fixed: Fixed, way: Way) -> Block | None:
    """What blocks a way of parts past others; None where it is free.

    The legs are tried one after the other, each at its own place before the next.

    Args:
        moving: Corners (n, 3, 3) of the moving parts at the end of the way, by name.
        fixed: What is in place.
        way: The way.

    Returns:
        The first contact on the leg that is blocked.
    """
    if not fixed.names:
        return None
    names = list(moving)
    surface = Surface.joined(list(moving.values()))
    for number, leg in enumerate(way):
        later = way[number + 1 :]
        left = sum((np.multiply(n.direction, n.length_mm) for n in later), np.zeros(3))
        contact = first_contact(
            Surface(surface.corners_mm - left, surface.body),
            fixed.surface,
            leg.direction,
            leg.length_mm,
        )
        if contact is not None:
            rest = contact.short_mm + sum(n.length_mm for n in later)
            return Block(
                names[contact.moving], fixed.names[contact.fixed], rest, contact.point_mm, way
            )
    return None


def driver_blocked(
    bodies: Bodies, screw: str, fixed: Fixed, way: Way, driver: Driver
) -> Block | None:
    """What keeps a driver from a screw: its shaft down to the head, its handle behind the blade."""
    direction = np.asarray(way[-1].direction)
    points = bodies.meshes[screw].vertices_mm
    along = points @ direction
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    head = middle + (float(along.min()) - float(middle @ direction)) * direction
    discs = [
        _disc(head - (TIP_MM + behind) * direction, direction, size / 2)
        for behind, size in ((0.0, driver.shaft_mm), (driver.blade_mm, driver.handle_mm))
    ]
    contact = first_contact(Surface.joined(discs), fixed.surface, way[-1].direction)
    if contact is None:
        return None
    moving = f"{('shaft', 'handle')[contact.moving]} of the {driver.name} for {screw}"
    return Block(moving, fixed.names[contact.fixed], contact.short_mm, contact.point_mm, way)


def _disc(centre: Floats, direction: Floats, radius_mm: float) -> Floats:
    """Triangles (n, 3, 3) of a regular polygon around a circle, facing along a direction."""
    other = np.eye(3)[int(np.argmin(np.abs(direction)))]
    u = np.cross(other, direction)
    u /= np.linalg.norm(u)
    v = np.cross(direction, u)
    turn = np.arange(CORNERS + 1) * 2 * np.pi / CORNERS
    outer = radius_mm / np.cos(np.pi / CORNERS)
    rim = centre + outer * (np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v)
    return np.stack([np.broadcast_to(centre, (CORNERS, 3)), rim[:-1], rim[1:]], axis=1)
