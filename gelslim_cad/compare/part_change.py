"""Parts that change from one spec to another, and the units of work to do again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from gelslim_cad.build.fingerprint import combined
from gelslim_cad.build.stages import Stages
from gelslim_cad.build.work import Unit
from gelslim_cad.export.brep import shape_digest
from gelslim_cad.geometry.part import Part
from gelslim_cad.spec.reader import LoadedSpec

How = Literal["added", "removed", "reshaped", "moved", "detail"]
"""`detail`: shape or description differs while volume, size and place stay."""
SAME = 1e-6
"""Relative difference of volumes and sizes below which a solid counts as moved, not reshaped."""


@dataclass(frozen=True)
class PartChange:
    """A part that differs: volumes in mm³, the box's sides in mm; None where it is missing."""

    name: str
    how: How
    volume_before_mm3: float | None
    volume_after_mm3: float | None
    size_before_mm: tuple[float, float, float] | None
    size_after_mm: tuple[float, float, float] | None


@dataclass(frozen=True)
class PartChanges:
    """Parts that change, names of those that stay, and the units that a build would do again."""

    changed: tuple[PartChange, ...]
    kept: tuple[str, ...]
    units: tuple[str, ...]


def part_changes(first: LoadedSpec, second: LoadedSpec) -> PartChanges:
    """Compare the solids of two specs. Loads the CAD kernel; some seconds per spec.

    Raises SolidError where a part of either cannot be made.
    """
    before, after = Stages.prepare(first).plan(), Stages.prepare(second).plan()
    olds = {p.name: p for p in (*before.finger, *before.tooling)}
    news = {p.name: p for p in (*after.finger, *after.tooling)}
    old, new = ({n: _key(p) for n, p in parts.items()} for parts in (olds, news))
    names = tuple(dict.fromkeys((*olds, *news)))
    changed = tuple(
        _change(name, olds.get(name), news.get(name))
        for name in names
        if old.get(name) != new.get(name)
    )
    differing = {c.name for c in changed}
    inputs = {u.name: _inputs(u) for u in before.units}
    redo = tuple(
        u.name
        for u in after.units
        if inputs.get(u.name) != _inputs(u)
        or not differing.isdisjoint(p.part.name for p in u.parts)
    )
    return PartChanges(changed, tuple(n for n in names if n not in differing), redo)


def _key(part: Part) -> str:
    """Digest of solid and description; the solid's rounded, as its last bits vary by run."""
    description = replace(part, solid=None, tags=frozenset())
    return combined(shape_digest(part.solid), repr(description), *sorted(part.tags))


def _inputs(unit: Unit) -> tuple[Any, ...]:
    """All inputs of a unit of work except the solids of the finger's parts."""
    return unit.kind, repr(unit.options), unit.content, tuple(p.part.name for p in unit.parts)


def _change(name: str, before: Part | None, after: Part | None) -> PartChange:
    one, two = _measured(before), _measured(after)
    return PartChange(name, _how(before, after), one[0], two[0], one[1], two[1])


def _measured(part: Part | None) -> tuple[float | None, tuple[float, float, float] | None]:
    if part is None:
        return None, None
    volume, *sides = _sizes(part)
    return volume, (sides[0], sides[1], sides[2])


def _sizes(part: Part) -> tuple[float, float, float, float]:
    """Volume and the box's sides."""
    box: Any = part.solid.BoundingBox()
    return float(part.solid.Volume()), box.xlen, box.ylen, box.zlen


def _how(before: Part | None, after: Part | None) -> How:
    if before is None:
        return "added"
    if after is None:
        return "removed"
    one, two = _sizes(before), _sizes(after)
    if not all(map(_close, one, two)):
        return "reshaped"
    c1, c2 = before.solid.Center().toTuple(), after.solid.Center().toTuple()
    return "detail" if all(_close(a, b) for a, b in zip(c1, c2, strict=True)) else "moved"


def _close(a: float, b: float) -> bool:
    return abs(a - b) <= SAME * max(1.0, abs(a), abs(b))
