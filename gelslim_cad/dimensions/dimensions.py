"""All dependent dimensions of a finger, derived from its spec."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from gelslim_cad.dimensions import (  # noqa: F401  (registers)
    bend,
    cable,
    distortion,
    electronics,
    guide,
    housing,
    lens,
    mount,
    pad,
    placement,
    precompression,
    seat,
    thread,
    tip_light,
    view,
)
from gelslim_cad.dimensions.fold.fold import Fold
from gelslim_cad.dimensions.fold.solver import threads
from gelslim_cad.dimensions.registry import REGISTRY, Dimension, identifier
from gelslim_cad.geometry.lookup import NamedValues
from gelslim_cad.geometry.names import DimensionName, FloatName, IntName
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import leaves
from gelslim_core.html_table import table_html

KEPT = 1e-6
"""A fold that misses its limits by no more than this part of their scales keeps them."""


@dataclass(frozen=True)
class Derived:
    """What is derived from one spec or from a batch of specs.

    Attributes:
        values: Each dimension by its dotted name.
        given: The spec's fields by dotted path.
        solved: What the internal dimensions are computed from, by their dotted names.
    """

    values: Mapping[str, Any]
    given: Mapping[str, Any]
    solved: Mapping[str, Any]

    @property
    def fold(self) -> Fold:
        """The layout of camera and mirror that the search found."""
        found: Fold = self.solved["fold.layout"]
        return found

    def value(self, name: str) -> Any:
        """The value under a name that is known at run time only; KeyError where there is none."""
        if name in self.values:
            return self.values[name]
        if name in self.given:
            return self.given[name]
        raise KeyError(f"no dimension or spec field is called {name}")

    def argument(self, parameter: str) -> tuple[str, Any]:
        """Dotted name and value of a function parameter such as `gel_length_mm`."""
        entry = REGISTRY.get(parameter)
        if entry is not None:
            return entry.name, (self.solved if entry.internal else self.values)[entry.name]
        path = PATHS[parameter]
        return path, self.given[path]

    def inputs(self, name: str) -> tuple[tuple[str, Any], ...]:
        """Names and values of the inputs of a dimension, spec fields among them."""
        entry = definition(name)
        return tuple(self.argument(p) for p in entry.inputs)

    def record(self, name: str) -> dict[str, Any]:
        """A dimension as plain values: with unit, meaning, formula, source and plain inputs."""
        entry = definition(name)
        return {
            "value": self.values[name],
            "unit": entry.unit,
            "meaning": entry.title,
            "formula": entry.formula,
            "source": entry.source,
            "inputs": {
                n: v
                for n, v in self.inputs(name)
                if isinstance(v, int | float | str | tuple) or v is None
            },
        }


@dataclass(frozen=True)
class Dimensions(Derived, NamedValues):
    """The dimensions of one finger: `d["finger.thickness_mm"]`.

    Attributes:
        values: Each dimension by its dotted name, in the unit that ends the name.
        given: The spec's fields by dotted path.
        solved: What the internal dimensions are computed from, by their dotted names.
    """

    def feasible(self) -> bool:
        """Whether the fold keeps every limit."""
        return bool(np.all(self.fold.worst() <= KEPT))

    def _repr_html_(self) -> str:
        """A table for notebooks: each dimension with its unit and meaning."""
        rows = (
            (entry.name, f"{self.values[entry.name]:.4g}", entry.unit, entry.title)
            for entry in REGISTRY.values()
            if not entry.internal
        )
        return table_html(("dimension", "value", "unit", "meaning"), rows)


@dataclass(frozen=True)
class DimensionsBatch(Derived):
    """The dimensions of n fingers: `batch["finger.thickness_mm"]` is an array (n,).

    Attributes:
        values: Each dimension by its dotted name, arrays (n,).
        given: The spec's fields by dotted path: arrays (n,) where they differ between designs.
        solved: What the internal dimensions are computed from, by their dotted names.
    """

    def __getitem__(self, name: DimensionName | FloatName | IntName) -> NDArray[np.float64]:
        return np.broadcast_to(np.asarray(self.value(name), dtype=float), (len(self),))

    def __len__(self) -> int:
        return len(self.values["finger.thickness_mm"])

    def feasible(self) -> NDArray[np.bool_]:
        """Which of the folds (n,) keep every limit."""
        return np.broadcast_to(self.fold.worst() <= KEPT, (len(self),))


def definition(name: str) -> Dimension:
    """The definition of a dimension; KeyError when there is none of that name."""
    entry = REGISTRY.get(identifier(name))
    if entry is None or entry.name != name:
        raise KeyError(f"no dimension is called {name}")
    return entry


def _paths() -> dict[str, str]:
    """Spec path by parameter name, from the model classes alone."""

    def walk(model: type[BaseModel], prefix: str) -> Iterator[str]:
        for name, field in model.model_fields.items():
            kind = field.annotation
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                yield from walk(kind, f"{prefix}{name}.")
            else:
                yield f"{prefix}{name}"

    paths: dict[str, str] = {}
    for path in walk(Spec, ""):
        key = identifier(path)
        if key in paths or key in REGISTRY:
            raise ValueError(f"two names share the parameter {key}")
        paths[key] = path
    return paths


PATHS = _paths()


def _ordered() -> tuple[Dimension, ...]:
    """Dimensions so that each follows its inputs."""
    done: dict[str, Dimension] = {}

    def visit(entry: Dimension, trail: tuple[str, ...]) -> None:
        if entry.identifier in done:
            return
        if entry.identifier in trail:
            raise ValueError(f"dimensions depend on each other in a circle: {trail}")
        for parameter in entry.inputs:
            if parameter in REGISTRY:
                visit(REGISTRY[parameter], (*trail, entry.identifier))
            elif parameter not in PATHS:
                raise ValueError(f"{entry.name} needs {parameter}, which nothing provides")
        done[entry.identifier] = entry

    for entry in REGISTRY.values():
        visit(entry, ())
    return tuple(done.values())


ORDER = _ordered()


def derive(spec: Spec) -> Dimensions:
    """Derive all dependent dimensions of one spec.

    Args:
        spec: The spec.

    Returns:
        The dimensions, as floats.
    """
    given = dict(leaves(spec))
    computed, solved = _evaluate(given)
    values = {name: float(np.reshape(value, -1)[0]) for name, value in computed.items()}
    return Dimensions(values, given, solved)


def derive_batch(
    spec: Spec, overrides: Mapping[str, Any], *, jobs: int | None = None, among: int = 0
) -> DimensionsBatch:
    """Dimensions of n designs at once: `overrides` maps spec paths to arrays (n,).

    `jobs` threads search the folds of large batches (none: one per processor); the number never
    changes a value. `among`: of how many designs these are a part, if more are to come, so that
    small parts of many take the compiled search too. Raises KeyError for a path that the spec lacks
    and ValueError for `jobs` below 1. Values are not checked against the spec's ranges: draw them
    from within.
    """
    given: dict[str, Any] = dict(leaves(spec))
    for path, value in overrides.items():
        if path not in given:
            raise KeyError(f"no spec field is called {path}")
        given[path] = np.asarray(value)
    with threads(jobs, among):
        computed, solved = _evaluate(given)
    count = max((np.size(v) for v in overrides.values()), default=1)
    values = {name: np.broadcast_to(value, (count,)) for name, value in computed.items()}
    return DimensionsBatch(values, given, solved)


def _evaluate(given: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Values of the dimensions, and of the internal ones, by their dotted names."""
    known = {identifier(path): value for path, value in given.items()}
    results: dict[str, Any] = {}
    solved: dict[str, Any] = {}
    for entry in ORDER:
        value = entry.compute(*(known[p] for p in entry.inputs))
        known[entry.identifier] = value
        (solved if entry.internal else results)[entry.name] = value
    return results, solved
