"""Every leaf field of the spec with its legal range, as the models declare it."""

from __future__ import annotations

import math
import types
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, Union, get_args, get_origin

import annotated_types
import numpy as np
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from gelslim_cad.spec import Spec


@dataclass(frozen=True)
class Leaf:
    """A leaf field: its path, kind, default and, for numbers, its limits."""

    path: str
    kind: Literal["float", "int", "bool", "choice", "text", "list"]
    default: Any
    required: bool
    optional: bool
    low: float = 0.0
    high: float = 0.0
    low_open: bool = False
    high_open: bool = False
    choices: tuple[str, ...] = ()
    word: str = ""
    """A word allowed instead of a number."""


def _constraints(annotation: Any, metadata: list[Any]) -> Iterator[Any]:
    """Limits of a field, those inside `Annotated` and unions among them."""
    for item in metadata:
        if isinstance(item, FieldInfo):
            yield from item.metadata
        else:
            yield item
    for inner in get_args(annotation):
        if hasattr(inner, "__metadata__"):
            yield from _constraints(inner.__origin__, list(inner.__metadata__))


def _plain(annotation: Any) -> Any:
    """The annotation without None, words such as "auto", and `Annotated`."""
    if get_origin(annotation) in (Union, types.UnionType):
        members = [a for a in get_args(annotation) if a is not type(None)]
        (annotation,) = [a for a in members if get_origin(a) is not Literal]
    return getattr(annotation, "__origin__", annotation) if _annotated(annotation) else annotation


def _annotated(annotation: Any) -> bool:
    return hasattr(annotation, "__metadata__")


def _leaf(path: str, field: FieldInfo) -> Leaf:
    kind = _plain(field.annotation)
    optional = type(None) in get_args(field.annotation)
    required = field.is_required()
    default = None if required else field.default
    if get_origin(kind) is Literal:
        return Leaf(path, "choice", default, required, optional, choices=get_args(kind))
    if kind in (bool, str):
        return Leaf(path, "bool" if kind is bool else "text", default, required, optional)
    if get_origin(kind) is tuple:
        return Leaf(path, "list", default, required, optional)
    low = high = None
    low_open = high_open = False
    for c in _constraints(field.annotation, field.metadata):
        if isinstance(c, annotated_types.Ge) and (low is None or c.ge >= low):
            low, low_open = c.ge, False
        if isinstance(c, annotated_types.Gt) and (low is None or c.gt >= low):
            low, low_open = c.gt, True
        if isinstance(c, annotated_types.Le):
            high, high_open = c.le, False
        if isinstance(c, annotated_types.Lt):
            high, high_open = c.lt, True
    assert kind in (int, float), path
    assert low is not None, f"{path} has no lower limit"
    assert high is not None, f"{path} has no upper limit"
    name: Literal["int", "float"] = "int" if kind is int else "float"
    words = [get_args(a)[0] for a in get_args(field.annotation) if get_origin(a) is Literal]
    word = words[0] if words else ""
    return Leaf(path, name, default, required, optional, low, high, low_open, high_open, word=word)


def _leaves(model: type[BaseModel], prefix: str = "") -> Iterator[Leaf]:
    for name, field in model.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            yield from _leaves(kind, f"{prefix}{name}.")
        else:
            yield _leaf(f"{prefix}{name}", field)


LEAVES: dict[str, Leaf] = {
    leaf.path: leaf
    for leaf in _leaves(Spec)
    if leaf.path not in ("format", "name", "manufacturing.prices")
    and not leaf.path.startswith(("camera.distortion.", "parts."))
}
"""All leaf fields but format, name, and names of files, by path.

Coefficients of a distortion are drawn by `legal_specs.distorted`: few of their range make a lens.
"""

TEXTS = (
    "part",
    "Größe µ 漢字",
    "=1+1",
    'a "quoted", name; here',
    "<b>bold</b> & more",
    "x" * 80,
    "",
)
ON_LIMIT = 0.15
WIDE_RATIO = 20.0


def short(value: float, digits: int = 4) -> float:
    """`value` to a few significant digits, as a person would write it."""
    return float(f"{value:.{digits}g}")


def anywhere(rng: np.random.Generator, leaf: Leaf) -> Any:
    """A value from the whole legal range of a field, its limits and None among them."""
    if leaf.kind == "choice":
        return str(rng.choice(leaf.choices))
    if leaf.kind == "bool":
        return bool(rng.random() < 0.5)
    if leaf.kind == "text":
        return str(rng.choice(TEXTS))
    if leaf.kind == "list":
        count = int(rng.integers(1, 9))
        return sorted({short(10 ** rng.uniform(-1, 1)) for _ in range(count)})
    if leaf.optional and rng.random() < 0.5:
        return None
    if leaf.word and rng.random() < 0.1:
        return leaf.word
    return _number(rng, leaf)


def _number(rng: np.random.Generator, leaf: Leaf) -> float | int:
    low, high = leaf.low, leaf.high
    draw = rng.random()
    if draw < ON_LIMIT and not leaf.low_open:
        value = low
    elif draw > 1 - ON_LIMIT and not leaf.high_open:
        value = high
    elif low > 0 and high / low <= WIDE_RATIO:
        value = rng.uniform(low, high)
    else:
        floor = low if low > 0 else high * 1e-4
        value = math.exp(rng.uniform(math.log(floor), math.log(high)))
    if leaf.kind == "int":
        return int(min(max(round(value), low), high))
    value = min(max(short(value), low), high)
    if leaf.high_open and value >= high:
        return short(0.999 * high)
    return short(max(1.001 * low, high * 1e-4)) if leaf.low_open and value <= low else value
