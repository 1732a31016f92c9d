"""The fields of a pydantic model as a flat table: path, unit, limits, default, description.

A unit is the last part of a field's name: `thickness_mm`, `youngs_modulus_mpa`.
"""

from __future__ import annotations

import re
import types
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

Limits = tuple[tuple[str, float], ...]
"""Pairs such as ("gt", 0.0)."""

_SCALES: dict[str, dict[str, float]] = {
    "length": {"nm": 1e-6, "um": 1e-3, "mm": 1, "cm": 10, "m": 1e3, "inch": 25.4, "in": 25.4},
    "area": {"mm2": 1, "cm2": 100},
    "volume": {"mm3": 1, "ml": 1e3},
    "angle": {"deg": 1, "rad": 57.29577951308232},
    "pressure": {"pa": 1e-6, "kpa": 1e-3, "mpa": 1, "gpa": 1e3},
    "force": {"n": 1, "mn": 1e-3, "kn": 1e3},
    "torque": {"n_mm": 1},
    "torsional stiffness": {"nm_per_rad": 1},
    "stiffness": {"n_per_mm": 1},
    "mass": {"g": 1e-3, "kg": 1},
    "density": {"kg_m3": 1, "kg_per_m3": 1, "g_cm3": 1e3, "g_per_cm3": 1e3},
    "time": {"us": 1e-3, "ms": 1, "s": 1e3},
    "frequency": {"hz": 1, "khz": 1e3, "fps": 1},
    "fraction": {"percent": 1, "ratio": 100},
    "speed": {"mm_s": 1, "mm_per_s": 1},
    "attenuation": {"per_mm": 1e3, "per_cm": 1e2, "per_m": 1},
    "current": {"ma": 1},
    "voltage": {"v": 1},
    "power": {"mw": 1, "w": 1e3},
    "luminous flux": {"lm": 1},
    "luminous intensity": {"mcd": 1},
    "temperature": {"c": 1},
    "pixels": {"px": 1},
    "charge": {"electrons": 1},
    "charge density": {"e_um2": 1},
    "grey value": {"dn": 1},
}
_LABELS = {
    "um": "µm",
    "inch": "inches",
    "in": "inches",
    "mm2": "mm²",
    "cm2": "cm²",
    "mm3": "mm³",
    "deg": "degrees",
    "rad": "radians",
    "pa": "Pa",
    "kpa": "kPa",
    "mpa": "MPa",
    "gpa": "GPa",
    "n": "N",
    "mn": "mN",
    "kn": "kN",
    "n_mm": "N·mm",
    "nm_per_rad": "N·m/rad",
    "n_per_mm": "N/mm",
    "px": "pixels",
    "kg_m3": "kg/m³",
    "kg_per_m3": "kg/m³",
    "g_cm3": "g/cm³",
    "g_per_cm3": "g/cm³",
    "us": "µs",
    "hz": "Hz",
    "khz": "kHz",
    "fps": "frames/s",
    "percent": "%",
    "ratio": "",
    "mm_s": "mm/s",
    "mm_per_s": "mm/s",
    "per_mm": "1/mm",
    "per_cm": "1/cm",
    "per_m": "1/m",
    "ma": "mA",
    "v": "V",
    "mw": "mW",
    "w": "W",
    "e_um2": "electrons/µm²",
    "dn": "grey levels",
    "c": "°C",
}


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
    suffix: Unit(_LABELS.get(suffix, suffix), quantity, float(size))
    for quantity, sizes in _SCALES.items()
    for suffix, size in sizes.items()
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
        shape = shape.merged(_shape(member))
    return shape


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
