"""The fields of a pydantic model as a flat table: path, unit, limits, default, description.

A unit is the last part of a field's name: `thickness_mm`, `youngs_modulus_mpa`.
"""

from __future__ import annotations

import re
import types
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

Limits = tuple[tuple[str, float], ...]
"""Pairs such as ("gt", 0.0)."""

_UNITS = """
length      nm,nm,1e-6 um,µm,1e-3 mm,mm,1 cm,cm,10 m,m,1e3 inch,inches,25.4 in,inches,25.4
area        mm2,mm²,1 cm2,cm²,100
volume      mm3,mm³,1 ml,ml,1e3
angle       deg,degrees,1 rad,radians,57.29577951308232
pressure    pa,Pa,1e-6 kpa,kPa,1e-3 mpa,MPa,1 gpa,GPa,1e3
force       n,N,1 mn,mN,1e-3 kn,kN,1e3
torque      n_mm,N·mm,1
torsion     nm_per_rad,N·m/rad,1
stiffness   n_per_mm,N/mm,1
mass        g,g,1e-3 kg,kg,1
density     kg_m3,kg/m³,1 kg_per_m3,kg/m³,1 g_cm3,g/cm³,1e3 g_per_cm3,g/cm³,1e3
time        us,µs,1e-3 ms,ms,1 s,s,1e3
frequency   hz,Hz,1 khz,kHz,1e3 fps,frames/s,1
fraction    percent,%,1 ratio,,100
speed       mm_s,mm/s,1 mm_per_s,mm/s,1
attenuation per_mm,1/mm,1e3 per_cm,1/cm,1e2 per_m,1/m,1
current     ma,mA,1
voltage     v,V,1
power       mw,mW,1 w,W,1e3
flux        lm,lm,1
intensity   mcd,mcd,1
temperature c,°C,1
pixels      px,pixels,1
charge      electrons,electrons,1
full_well   e_um2,electrons/µm²,1
grey_value  dn,grey_levels,1
"""
"""For each quantity its units: suffix of a field's name, label, size in a common unit."""


@dataclass(frozen=True)
class Unit:
    """A unit: how it is written, what it measures, and its size in a common unit of that."""

    label: str
    quantity: str
    size: float

    def convert(self, value: float, target: Unit | None) -> float | None:
        """`value` in this unit expressed in `target`; None where they measure different things."""
        if target is None or target == self or target.quantity != self.quantity:
            return None
        return float(f"{value * self.size / target.size:.10g}")


UNITS = {
    suffix: Unit(label.replace("_", " "), quantity, float(size))
    for quantity, *units in map(str.split, _UNITS.strip().splitlines())
    for suffix, label, size in (unit.split(",") for unit in units)
}
_LONGEST_FIRST = sorted(UNITS, key=len, reverse=True)


def split_unit(name: str) -> tuple[str, Unit | None]:
    """`thickness_mm` as (`thickness`, millimetres); a name without a unit as it is, with None."""
    for suffix in _LONGEST_FIRST:
        if name.endswith(f"_{suffix}"):
            return name[: -len(suffix) - 1], UNITS[suffix]
    return name, None


@dataclass(frozen=True, kw_only=True)
class Shape:
    """What a value may be."""

    types: tuple[type, ...] = ()
    """Plain types: float, int, bool, str, list, or a model."""
    choices: tuple[Any, ...] = ()
    """Literal values allowed besides `types`."""
    nullable: bool = False
    limits: Limits = ()
    length: tuple[int, int | None] = (0, None)
    """Least and largest number of characters or items; None without a limit."""
    pattern: str | None = None
    """Regular expression that text must match."""
    item: Shape | None = None
    """What the items of a list may be."""

    def merged(self, other: Shape) -> Shape:
        """The shape of a value that fits either of the two."""
        return Shape(
            types=self.types + other.types,
            choices=self.choices + other.choices,
            nullable=self.nullable or other.nullable,
            limits=self.limits + other.limits,
            length=self.length if self.length != (0, None) else other.length,
            pattern=self.pattern or other.pattern,
            item=self.item or other.item,
        )

    @property
    def models(self) -> tuple[type[BaseModel], ...]:
        """The models among `types`."""
        return tuple(kind for kind in self.types if issubclass(kind, BaseModel))


@dataclass(frozen=True, kw_only=True)
class Field(Shape):
    """One field of a model."""

    path: str
    """Dotted from the top of the model; below the items of a list it contains `[]`."""
    name: str
    description: str
    required: bool
    default: Any
    """Meaningless where `required`."""

    @property
    def unit(self) -> Unit | None:
        """The unit in the name."""
        return split_unit(self.name)[1]


@lru_cache(maxsize=32)
def field_table(model: type[BaseModel]) -> tuple[Field, ...]:
    """Every field of `model` and of the models below it, in order of declaration, blocks first."""
    return tuple(_walk(model, "", ()))


def model_fields(model: type[BaseModel], path: str = "") -> Iterator[Field]:
    """The fields of `model` itself, a block at the dotted `path`."""
    for name, info in model.model_fields.items():
        shape = _shape(info.annotation).merged(_constraints(info.metadata))
        yield Field(
            **vars(shape),
            path=f"{path}.{name}" if path else name,
            name=name,
            description=(info.description or "").rstrip("."),
            required=info.is_required(),
            default=None if info.is_required() else info.get_default(call_default_factory=True),
        )


def field_at(model: type[BaseModel], path: str) -> Field | None:
    """The field at a dotted path, the first of its name where a union has several."""
    wanted = without_indices(path)
    return next((field for field in field_table(model) if field.path == wanted), None)


def children(model: type[BaseModel], path: str) -> tuple[Field, ...]:
    """The fields directly below the block at `path`; those at the top for an empty path."""
    prefix = without_indices(path) + "." if path else ""
    return tuple(field for field in field_table(model) if field.path == prefix + field.name)


def without_indices(path: str) -> str:
    """`loads[3].force_n` as the table writes it, `loads[].force_n`."""
    return re.sub(r"\[[^\]]*\]", "[]", path)


def unit_label(unit: Unit | None) -> str:
    """` mm`, with its space; empty without a unit."""
    return f" {unit.label}" if unit and unit.label else ""


def range_text(shape: Shape, unit: Unit | None) -> str:
    """`from 0.3 to 15 mm`, `above 0 and at most 2`, `above 0 mm`; empty without limits."""
    low = max(((v, k) for k, v in shape.limits if k in ("gt", "ge")), default=None)
    high = min(((v, k) for k, v in shape.limits if k in ("lt", "le")), default=None)
    if low and high and (low[1], high[1]) == ("ge", "le"):
        return f"from {low[0]:.12g} to {high[0]:.12g}{unit_label(unit)}"
    words = []
    if low:
        words.append(f"{'above' if low[1] == 'gt' else 'at least'} {low[0]:.12g}")
    if high:
        words.append(f"{'below' if high[1] == 'lt' else 'at most'} {high[0]:.12g}")
    return " and ".join(words) + unit_label(unit) if words else ""


def _walk(model: type[BaseModel], path: str, parents: tuple[type, ...]) -> Iterator[Field]:
    if model in parents:
        return
    for field in model_fields(model, path):
        yield field
        for held, below in ((field, field.path), (field.item or Shape(), f"{field.path}[]")):
            for kind in held.models:
                yield from _walk(kind, below, (*parents, model))


def _shape(annotation: Any) -> Shape:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if annotation is type(None):
        return Shape(nullable=True)
    if origin is Annotated:
        return _shape(arguments[0]).merged(_constraints(arguments[1:]))
    if origin in (Union, types.UnionType):
        return _union(arguments)
    if origin is Literal:
        return Shape(choices=arguments)
    if origin in (list, tuple, set, frozenset):
        members = [member for member in arguments if member is not Ellipsis]
        is_fixed = origin is tuple and len(members) == len(arguments)
        length = (len(members), len(members)) if is_fixed else (0, None)
        return Shape(types=(list,), length=length, item=_union(members))
    kind = origin if isinstance(origin, type) else annotation
    return Shape(types=(kind,) if isinstance(kind, type) else ())


def _union(members: Any) -> Shape:
    shape = Shape()
    for member in members:
        other = _shape(member)
        both = list in shape.types and list in other.types
        shape = shape.merged(other)
        if both:
            shape = replace(shape, length=_either(shape.length, other.length))
    return shape


def _either(one: tuple[int, int | None], other: tuple[int, int | None]) -> tuple[int, int | None]:
    """Lengths of a list that may be of one kind or the other."""
    most = None if one[1] is None or other[1] is None else max(one[1], other[1])
    return min(one[0], other[0]), most


def _constraints(metadata: Any) -> Shape:
    """The limits of a value, from what pydantic keeps beside its type."""
    flat = [m for a in metadata for m in (a.metadata if isinstance(a, FieldInfo) else (a,))]
    found = {
        name: getattr(item, name)
        for item in flat
        for name in ("min_length", "max_length", "pattern")
        if getattr(item, name, None) is not None
    }
    limits = tuple(
        (kind, float(getattr(item, kind)))
        for item in flat
        for kind in ("gt", "ge", "lt", "le")
        if isinstance(getattr(item, kind, None), int | float)
    )
    length = (found.get("min_length", 0), found.get("max_length"))
    return Shape(limits=limits, length=length, pattern=found.get("pattern"))
