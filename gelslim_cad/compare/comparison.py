"""Changes from one spec to another: fields, dimensions, design rules, bundle. Needs no CAD."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gelslim_cad.checks import Check, check
from gelslim_cad.dimensions import Dimensions, definition, derive
from gelslim_cad.dimensions.registry import unit_of
from gelslim_cad.geometry.sight import camera_record
from gelslim_cad.sensor.pad import marker_grid, pad_mesh
from gelslim_cad.spec import Spec
from ifem_export.errors import IfemError

SAME = 1e-9
"""Relative difference below which numbers count as equal: the accuracy of the fold's solver."""


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
        grid = marker_grid(d)
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
