"""The declaration of an effect, which is all that the planner needs of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from operator import add
from typing import Any

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters

OBSERVABLES = ("displacement", "force", "markers", "image")
"""Data that a scene may observe."""
GIVEN = frozenset({"poses"})
"""Data that come with scene and sensor, so that no effect has to provide them."""
_FIELDS = {o: f"{o}_n" if o == "force" else f"{o}_px" for o in OBSERVABLES}


@dataclass(frozen=True)
class Bound:
    """Largest error in each observable.

    The error of forces is in N: the resultant of the error, or for shear its sum over the nodes.
    The others are in pixels. Displacements count as the camera sees them where its scale is
    largest, markers as the shift of their true centres. An error of grey values counts as the
    shift of a dot's edge that changes them as much: grey values over the slope of the edge.
    """

    force_n: float = 0.0
    displacement_px: float = 0.0
    markers_px: float = 0.0
    image_px: float = 0.0

    def of(self, observable: str) -> float:
        """The error of one observable, in its unit. Raises KeyError."""
        return float(getattr(self, _FIELDS[observable]))

    @classmethod
    def by_observable(cls, errors: Mapping[str, float]) -> Bound:
        """The errors by observable; those that are not given are zero."""
        return cls(**{_FIELDS[o]: error for o, error in errors.items()})

    @property
    def _values(self) -> tuple[float, float, float, float]:
        return self.force_n, self.displacement_px, self.markers_px, self.image_px

    def at_most(self, other: Bound) -> Bound:
        """The smaller error of each observable."""
        return Bound(*map(min, self._values, other._values))

    def at_least(self, other: Bound) -> Bound:
        """The larger error of each observable."""
        return Bound(*map(max, self._values, other._values))

    def plus(self, other: Bound) -> Bound:
        """The sum of the errors of each observable."""
        return Bound(*map(add, self._values, other._values))

    def times(self, factor: float) -> Bound:
        """Every error times a factor."""
        return Bound(*(factor * value for value in self._values))

    def to_record(self) -> dict[str, float]:
        """Errors by observable and unit."""
        return {f"{o}_{unit_of(o)}": self.of(o) for o in OBSERVABLES}


def combined(errors: Iterable[tuple[float, bool]]) -> float:
    """The error of several effects in one observable, from pairs (error, is_scattered).

    Errors that move the gel or its image may all point the same way at the same dot, and add up.
    The largest error of a scattered effect is at any dot and in any direction, so that it adds to
    others as independent errors do: the root of the sum of the squares. In 97 random scenes all
    effects on the grey values at once shift a dot by 0.87 of that in the median and by 1.1 at most.
    """
    steady, scattered = 0.0, list[float]()
    for error, is_scattered in errors:
        if is_scattered:
            scattered.append(error)
        else:
            steady += error
    return math.hypot(steady, *scattered)


def unit_of(observable: str) -> str:
    """`n` for force, `px` for the others."""
    return "n" if observable == "force" else "px"


def geometry(px: float, force_n: float = 0.0) -> Bound:
    """An error that displaces the gel by `px` as the camera sees it, and so markers and image."""
    return Bound(force_n, px, px, px)


def optics(px: float) -> Bound:
    """An error in where the dots are seen."""
    return Bound(markers_px=px, image_px=px)


def picture(px: float) -> Bound:
    """An error in grey values, as the equivalent shift of an edge."""
    return Bound(image_px=px)


DIGITS = 3
"""Significant digits of what a probe finds: the last bits depend on the machine."""


def rounded_up(value: float, digits: int = DIGITS) -> float:
    """The value rounded up to significant digits; an infinite one stays."""
    if value <= 0 or math.isinf(value):
        return max(0.0, value)
    unit = 10.0 ** (math.floor(math.log10(value)) - digits + 1)
    return float(f"{math.ceil(value / unit) * unit:.{digits}g}")


@dataclass(frozen=True)
class Rung:
    """One way to simulate an effect: parameters, error relative to the exact effect, and time."""

    name: str
    error: Bound
    milliseconds: float
    """Predicted, per pose, on one core."""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    implementation: str = ""
    """Module to import, where it is not that of the effect."""


@dataclass(frozen=True)
class Effect:
    """Declaration of one physical effect.

    Attributes:
        name: Name in the scene file.
        description: What it is, for the reference of the scene file.
        parameters: Model of its block in the scene file.
        bound: Largest error of leaving it out.
        formula: The bound in words.
        ladder: Rungs with their errors and times.
        implementation: Module that computes it, imported only when a plan includes the effect.
        needs: Data that it takes.
        provides: Data that it computes from these.
        refines: Data of other effects that it changes.
        after: Effects that refine the same data before it.
        does_nothing: Whether its parameters make it do nothing, where a bound of zero does not
            tell.
        is_scattered: Whether it shifts single dots in directions that do not depend on how the gel
            moves, as a change of grey values does; `combined` says how such errors add up.
    """

    name: str
    description: str
    parameters: type[EffectParameters]
    bound: Callable[[Circumstances], Bound]
    formula: str
    ladder: Callable[[Circumstances], tuple[Rung, ...]]
    implementation: str
    needs: tuple[str, ...] = ()
    provides: tuple[str, ...] = ()
    refines: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    does_nothing: Callable[[Circumstances], bool] | None = None
    is_scattered: bool = False

    def size(self, c: Circumstances) -> Bound:
        """Error of leaving it out: its bound, or what a probe found where that is less."""
        bound = self.bound(c)
        if not self.was_probed(c):
            return bound
        assert c.probed is not None
        return bound.at_most(c.probed.sizes[self.name])

    def was_probed(self, c: Circumstances) -> bool:
        """Whether a probe solved the hardest poses with and without it."""
        return c.probed is not None and self.name in c.probed.sizes

    def is_null(self, c: Circumstances, bound: Bound | None = None) -> bool:
        """Whether its parameters make it do nothing; `bound` is its bound, where it is known."""
        if self.does_nothing is not None:
            return self.does_nothing(c)
        return (self.bound(c) if bound is None else bound) == Bound()
