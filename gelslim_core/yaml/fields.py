"""The fields of a pydantic model as a flat table: path, unit, limits, default, description."""

from __future__ import annotations

import types
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from gelslim_core.yaml.units import Unit, split_unit

LIMITS = ("gt", "ge", "lt", "le")


@dataclass(frozen=True)
class Field:
    """One field of a model.

    `path` is dotted from the top of the model; fields of the items of a list have `[]` in it.
    """

    path: str
    name: str
    description: str
    required: bool
    default: Any
    """Meaningless where `required`."""
    types: tuple[type, ...]
    """Plain types a value may have: float, int, bool, str, list, or a model."""
    choices: tuple[Any, ...]
    """Literal values allowed, beside `types`."""
    nullable: bool
    limits: tuple[tuple[str, float], ...]
    """Pairs such as ("gt", 0.0)."""
    item_limits: tuple[tuple[str, float], ...]
    """The same for the items of a list."""
    item_choices: tuple[Any, ...] = ()
    """Literal values allowed for the items of a list."""

    @property
    def unit(self) -> Unit | None:
        """The unit in the name."""
        return split_unit(self.name)[1]

    @property
    def models(self) -> tuple[type[BaseModel], ...]:
        """The models among `types`."""
        return tuple(kind for kind in self.types if issubclass(kind, BaseModel))


@dataclass(frozen=True)
class _Shape:
    types: tuple[type, ...] = ()
    choices: tuple[Any, ...] = ()
    nullable: bool = False
    limits: tuple[tuple[str, float], ...] = ()
    item: _Shape | None = None

    def __add__(self, other: _Shape) -> _Shape:
        return _Shape(
            self.types + other.types,
            self.choices + other.choices,
            self.nullable or other.nullable,
            self.limits + other.limits,
            self.item or other.item,
        )


def _limits(metadata: Any) -> tuple[tuple[str, float], ...]:
    return tuple(
        (kind, float(getattr(item, kind)))
        for item in metadata
        for kind in LIMITS
        if isinstance(getattr(item, kind, None), int | float)
    )


def _metadata_limits(arguments: tuple[Any, ...]) -> tuple[tuple[str, float], ...]:
    flat = [m for a in arguments for m in (a.metadata if isinstance(a, FieldInfo) else (a,))]
    return _limits(flat)


def _shape(annotation: Any) -> _Shape:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if annotation is type(None):
        return _Shape(nullable=True)
    if origin is Annotated:
        return _shape(arguments[0]) + _Shape(limits=_metadata_limits(arguments[1:]))
    if origin in (Union, types.UnionType):
        return sum((_shape(member) for member in arguments), _Shape())
    if origin is Literal:
        return _Shape(choices=arguments)
    if origin in (list, tuple, set, frozenset):
        members = [member for member in arguments if member is not Ellipsis]
        items = sum((_shape(member) for member in members), _Shape())
        return _Shape(types=(list,), item=items)
    if isinstance(origin, type):
        return _Shape(types=(origin,))
    return _Shape(types=(annotation,) if isinstance(annotation, type) else ())


def _walk(model: type[BaseModel], prefix: str, parents: tuple[type, ...]) -> Iterator[Field]:
    if model in parents:
        return
    for name, info in model.model_fields.items():
        shape = _shape(info.annotation) + _Shape(limits=_limits(info.metadata))
        item = shape.item or _Shape()
        default = None if info.is_required() else info.get_default(call_default_factory=True)
        path = f"{prefix}{name}"
        yield Field(
            path,
            name,
            (info.description or "").rstrip("."),
            info.is_required(),
            default,
            shape.types,
            shape.choices,
            shape.nullable,
            shape.limits,
            item.limits,
            item.choices,
        )
        for kinds, below in ((shape.types, f"{path}."), (item.types, f"{path}[].")):
            for kind in kinds:
                if issubclass(kind, BaseModel):
                    yield from _walk(kind, below, (*parents, model))


@lru_cache(maxsize=32)
def field_table(model: type[BaseModel]) -> tuple[Field, ...]:
    """Every field of `model` and of the models below it, in order of declaration, blocks first."""
    return tuple(_walk(model, "", ()))


def pattern(path: str) -> str:
    """`loads[3].force_n` as the table writes it, `loads[].force_n`."""
    while "[" in path:
        head, _, rest = path.partition("[")
        tail = rest.partition("]")[2]
        path = f"{head}\0{tail}"
    return path.replace("\0", "[]")


def field_at(model: type[BaseModel], path: str) -> Field | None:
    """The field at a dotted path, the first of its name where a union has several."""
    wanted = pattern(path)
    return next((field for field in field_table(model) if field.path == wanted), None)


def children(model: type[BaseModel], path: str) -> tuple[Field, ...]:
    """The fields directly below the block at `path` (empty: the top)."""
    prefix = pattern(path) + "." if path else ""
    return tuple(
        field
        for field in field_table(model)
        if field.path.startswith(prefix) and field.path[len(prefix) :] == field.name
    )
