"""An effect as the planner sees it: a declaration, light enough to import always."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters

OBSERVABLES = ("displacement", "force", "markers", "image")
"""Data that a scene may observe."""
GIVEN = frozenset({"poses"})
"""Data that need no effect: they come with scene and sensor."""
_FIELDS = {o: f"{o}_n" if o == "force" else f"{o}_px" for o in OBSERVABLES}


@dataclass(frozen=True)
class Bound:
    """Largest error in each observable.

    Forces in N: the resultant of the error, or for shear its sum over the nodes. The others in
    pixels: displacements as seen by the camera where its scale is largest, markers as the shift
    of their true centres, and the image as the shift of a dot's edge that would change the grey
    values as much, that is grey levels divided by the grey slope of an edge.
    """

    force_n: float = 0.0
    displacement_px: float = 0.0
    markers_px: float = 0.0
    image_px: float = 0.0

    def of(self, observable: str) -> float:
        """The error of one observable, in its unit. Raises KeyError."""
        return float(getattr(self, _FIELDS[observable]))

    def at_most(self, other: Bound) -> Bound:
        """The smaller error of each observable."""
        return Bound(
            min(self.force_n, other.force_n),
            min(self.displacement_px, other.displacement_px),
            min(self.markers_px, other.markers_px),
            min(self.image_px, other.image_px),
        )

    def to_record(self) -> dict[str, float]:
        """By observable with its unit."""
        return {f"{o}_{unit_of(o)}": self.of(o) for o in OBSERVABLES}


def unit_of(observable: str) -> str:
    """`n` for force, `px` for the others."""
    return "n" if observable == "force" else "px"


def geometry(px: float, force_n: float = 0.0) -> Bound:
    """An error that moves the gel by `px` as seen by the camera: everything after it moves too."""
    return Bound(force_n, px, px, px)


def optics(px: float) -> Bound:
    """An error in where the dots are seen."""
    return Bound(markers_px=px, image_px=px)


def picture(px: float) -> Bound:
    """An error in grey values, as the edge shift that does the same."""
    return Bound(image_px=px)


@dataclass(frozen=True)
class Rung:
    """One way to simulate an effect: its name, knobs, error against the effect itself, and cost."""

    name: str
    error: Bound
    milliseconds: float
    """Predicted, per pose, on one core."""
    parameters: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Effect:
    """One effect.

    `provides` names data it makes from `needs`; `refines` names data that others provide and that
    it changes. `after` names refinements of the same data that come before it. `bound` is the
    largest error of leaving it out, `formula` the same in words; `is_null` tells that its
    parameters make it do nothing. `implementation` is the module with its `apply`, imported only
    when a plan keeps the effect.
    """

    name: str
    title: str
    parameters: type[EffectParameters]
    bound: Callable[[Circumstances], Bound]
    formula: str
    ladder: Callable[[Circumstances], tuple[Rung, ...]]
    is_null: Callable[[Circumstances], bool]
    implementation: str
    needs: tuple[str, ...] = ()
    provides: tuple[str, ...] = ()
    refines: tuple[str, ...] = ()
    after: tuple[str, ...] = ()


def never_null(_c: Circumstances) -> bool:
    """For effects that no parameter turns off."""
    return False
