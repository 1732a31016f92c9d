"""Changes from one spec to another: fields, dimensions, design rules, bundle, parts.

Only `part_changes` needs the CAD kernel.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from gelslim_cad.build.fingerprint import combined
from gelslim_cad.build.work import Unit, described
from gelslim_cad.checks import Check, check
from gelslim_cad.dimensions import Dimensions, definition, derive
from gelslim_cad.dimensions.registry import unit_of
from gelslim_cad.export.brep import shape_digest
from gelslim_cad.geometry.optics import camera_record
from gelslim_cad.geometry.part import Part
from gelslim_cad.sensor import pad_mesh, printed_grid
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import LoadedSpec
from ifem_export.errors import IfemError

SAME = 1e-9
"""Relative difference below which numbers count as equal: the accuracy of the fold's solver."""
How = Literal["added", "removed", "reshaped", "moved", "detail"]
"""`detail`: shape or description differs while volume, size and place stay."""
SAME_SIZE = 1e-6
"""Relative difference of volumes and sizes below which a solid counts as moved, not reshaped."""


@dataclass(frozen=True)
class Change:
    """A value that differs; `meaning` describes a dimension."""

    name: str
    unit: str
    before: Any
    after: Any
    meaning: str = ""

    @property
    def difference(self) -> float | None:
        """`after` minus `before`; None where one of them is no number."""
        pair = (self.before, self.after)
        if any(isinstance(v, bool) or not isinstance(v, int | float) for v in pair):
            return None
        return float(self.after) - float(self.before)


@dataclass(frozen=True)
class RuleChange:
    """A design rule whose value, limit or status differs."""

    before: Check
    after: Check

    @property
    def id(self) -> str:
        """The rule."""
        return self.after.id

    @property
    def verdict(self) -> str:
        """Whether the status gets worse, gets better, or only the numbers change."""
        order = ("pass", "warn", "fail")
        step = order.index(self.after.status) - order.index(self.before.status)
        return "moves" if step == 0 else "gets worse" if step > 0 else "gets better"


@dataclass(frozen=True)
class Comparison:
    """All changes from one spec to another except those of parts."""

    fields: tuple[Change, ...]
    dimensions: tuple[Change, ...]
    rules: tuple[RuleChange, ...]
    bundle: tuple[BundleChange, ...]

    @property
    def same(self) -> bool:
        """Whether nothing changes."""
        return not (self.fields or self.dimensions or self.rules or self.bundle)


def compare(first: Spec, second: Spec) -> Comparison:
    """What changes from the first spec to the second; a pure function of the two."""
    before, after = derive(first), derive(second)
    return Comparison(
        tuple(_fields(before, after)),
        tuple(_dimensions(before, after)),
        tuple(_rules(before, after)),
        bundle_changes(before, after),
    )


def differ(before: Any, after: Any) -> bool:
    """Whether two values differ by more than the solver's accuracy."""
    numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in (before, after))
    if not numbers:
        return bool(before != after)
    if math.isnan(before) or math.isnan(after):
        return math.isnan(before) != math.isnan(after)
    return not math.isclose(before, after, rel_tol=SAME, abs_tol=SAME)


def _fields(before: Dimensions, after: Dimensions) -> Iterable[Change]:
    for path, value in before.given.items():
        if value != after.given[path]:
            yield Change(path, unit_of(path), value, after.given[path])


def _dimensions(before: Dimensions, after: Dimensions) -> Iterable[Change]:
    for name, value in before.values.items():
        if differ(value, after.values[name]):
            entry = definition(name)
            yield Change(name, entry.unit, value, after.values[name], entry.title.rstrip("."))


def _rules(before: Dimensions, after: Dimensions) -> Iterable[RuleChange]:
    for old, new in zip(check(before), check(after), strict=True):
        if old.status != new.status or differ(old.value, new.value) or differ(old.limit, new.limit):
            yield RuleChange(old, new)


@dataclass(frozen=True)
class BundleChange:
    """A block of the bundle that differs, with a description before and after."""

    block: str
    before: str
    after: str


def bundle_changes(before: Dimensions, after: Dimensions) -> tuple[BundleChange, ...]:
    """Blocks that differ, in the bundle's order; the descriptions of both sides may be equal."""
    old, new = _blocks(before), _blocks(after)
    return tuple(
        BundleChange(name, old[name][0], new[name][0])
        for name in old
        if not _same(old[name][1], new[name][1])
    )


def _blocks(d: Dimensions) -> dict[str, tuple[str, tuple[Any, ...]]]:
    """For each block its description and the arrays and values that it holds."""
    e, nu = d["material.gel.youngs_modulus_mpa"], d["material.gel.poissons_ratio"]
    element = (d["mesh.element"], e, nu, d["material.gel.density_kg_m3"])
    return {
        **_pad(d),
        "element": (f"{element[0]}, E {e:g} MPa, ν {nu:g}", element),
        "camera": _camera(d),
    }


def _pad(d: Dimensions) -> dict[str, tuple[str, tuple[Any, ...]]]:
    # A design that breaks a rule may have no lattice or no mesh; that is a difference too.
    try:
        grid = printed_grid(d)
        if grid is None:
            return {"mesh": ("none", ()), "markers": ("none", ())}
        markers = (f"{len(grid)} markers", (grid.positions_mm, grid.diameter_mm, list(grid.kind)))
        mesh, _ = pad_mesh(d, grid)
    except IfemError as error:
        return {"mesh": (f"none: {error}", ()), "markers": ("none", ())}
    size = " × ".join(f"{c:.4g}" for c in mesh.cell_size_mm)
    words = f"{mesh.n_elements} elements of {size} mm, {mesh.n_nodes} nodes"
    fill = () if mesh.fill is None else (np.asarray(mesh.fill),)
    return {"mesh": (words, (np.asarray(mesh.nodes_mm), *fill)), "markers": markers}


def _camera(d: Dimensions) -> tuple[str, tuple[Any, ...]]:
    record: dict[str, Any] = dict(camera_record(d))
    x, _, z = record["position_mm"]
    words = f"virtual camera at x {x:.2f}, z {z:.2f} mm, f {record['focal_px']:.1f} px"
    return words, tuple(_leaves(record))


def _leaves(value: Any) -> list[Any]:
    if isinstance(value, dict):
        return [leaf for v in value.values() for leaf in _leaves(v)]
    if isinstance(value, list | tuple):
        return [leaf for v in value for leaf in _leaves(v)]
    return [value]


def _same(first: tuple[Any, ...], second: tuple[Any, ...]) -> bool:
    return len(first) == len(second) and all(map(_equal, first, second))


def _equal(first: Any, second: Any) -> bool:
    a, b = np.asarray(first), np.asarray(second)
    if a.shape != b.shape:
        return False
    if a.dtype.kind in "fi" and b.dtype.kind in "fi":
        return bool(np.allclose(a, b, rtol=1e-9, atol=1e-9, equal_nan=True))
    return bool(np.all(a == b))


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
    from gelslim_cad.build.stages import Stages

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
    return combined(shape_digest(part.solid), described(part))


def _inputs(unit: Unit) -> tuple[Any, ...]:
    """All inputs of a unit of work except the solids of the finger's parts."""
    return unit.kind, repr(unit.options), tuple(p.part.name for p in unit.parts)


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
    return abs(a - b) <= SAME_SIZE * max(1.0, abs(a), abs(b))
