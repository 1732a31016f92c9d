"""The order of assembly as data: which parts move together, along which way, what holds them.

A step joins two groups of parts, each put together by earlier steps. Every part comes to its place
by exactly one step, or is the first of its group.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from gelslim_cad.assembly.drivers import Driver

Vector = tuple[float, float, float]
UP: Vector = (0.0, 0.0, 1.0)
DOWN: Vector = (0.0, 0.0, -1.0)


@dataclass(frozen=True)
class Leg:
    """A straight piece of a way; the first comes from far outside.

    Attributes:
        direction: Unit vector in the sensor frame.
        length_mm: Length; infinite for the first leg.
    """

    direction: Vector
    length_mm: float = math.inf


Way = tuple[Leg, ...]
"""Straight pieces, of which the last ends where the part is assembled."""


@dataclass(frozen=True)
class Fastener:
    """A screw, insert or nut that a step places.

    Attributes:
        part: Name of the part.
        way: How it comes to its place.
        driver: What turns it; None for what is pressed or glued.
    """

    part: str
    way: Way
    driver: Driver | None = None


@dataclass(frozen=True)
class Step:
    """One step of the assembly.

    Attributes:
        key: Name of its own, such as `led_board_red`.
        text: Name under which the instructions keep their text, such as `led_board`.
        moves: Names of the parts that move, as one body.
        stays: Names of the parts that are in place.
        way: How the parts move.
        others: Ways that do as well, tried where the first is blocked.
        held_by: What holds the parts afterwards.
        fasteners: What is placed after the parts, one after the other.
        ignored: Parts that the moving ones bend or push aside, with the reason.
    """

    key: str
    text: str
    moves: tuple[str, ...]
    stays: tuple[str, ...]
    way: Way
    others: tuple[Way, ...]
    held_by: str
    fasteners: tuple[Fastener, ...] = ()
    ignored: tuple[tuple[str, str], ...] = ()


@dataclass
class Bench:
    """Groups of parts while they are put together; it writes the steps down."""

    names: tuple[str, ...]
    """All parts of the finger."""
    steps: list[Step] = field(default_factory=list)
    _groups: dict[str, list[str]] = field(default_factory=dict)

    def begin(self, group: str) -> None:
        """Begin a group with the part of its name."""
        self._groups[group] = [name for name in self.names if name == group]

    def named(self, *prefixes: str) -> tuple[str, ...]:
        """Parts whose names begin so."""
        return tuple(name for name in self.names if name.startswith(prefixes))

    def join(
        self,
        key: str,
        group: str,
        moves: Iterable[str],
        way: Way,
        held_by: str,
        *,
        fasteners: Iterable[Fastener] = (),
        text: str = "",
        others: Iterable[Way] = (),
        ignored: Iterable[tuple[str, str]] = (),
    ) -> None:
        """Bring parts, or whole groups, to a group; nothing happens where there is nothing to do.

        `moves` are names of groups or parts; a group that has moved is part of the other then.
        """
        moving: list[str] = []
        for name in moves:
            moving += self._groups.pop(name, [n for n in self.names if n == name])
        placed = tuple(fasteners)
        if not moving and not placed:
            return
        stays = self._groups[group]
        self.steps.append(
            Step(
                key,
                text or key,
                tuple(moving),
                tuple(stays),
                way,
                tuple(w for w in others if w != way),
                held_by,
                placed,
                tuple(ignored),
            )
        )
        self._groups[group] = [*stays, *moving, *(f.part for f in placed)]

    def finished(self, group: str) -> tuple[Step, ...]:
        """The steps, when all parts are in one group.

        Raises:
            ValueError: A part has no step or two.
        """
        placed = self._groups[group]
        left = sorted(set(self.names) - set(placed))
        twice = sorted({name for name in placed if placed.count(name) > 1})
        if left or twice:
            raise ValueError(f"no step of the assembly for {left}, several for {twice}")
        return tuple(self.steps)
