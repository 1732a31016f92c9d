"""All dependent dimensions of a finger, derived from its spec."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import BaseModel

from gelslim_cad.dimensions import bend, guide, housing, pad, placement, view  # noqa: F401  (registers)
from gelslim_cad.dimensions.fold import Fold
from gelslim_cad.dimensions.registry import REGISTRY, Dimension
from gelslim_cad.dimensions.solver import threads
from gelslim_cad.spec import Spec

SHORT_BLOCK = "design."


def identifier(path: str) -> str:
    """Function-parameter name of a spec path: `design.gel.length_mm` is `gel_length_mm`."""
    return path.removeprefix(SHORT_BLOCK).replace(".", "_")


def leaves(block: BaseModel, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted path and value of every leaf field."""
    for name in type(block).model_fields:
        value = getattr(block, name)
        path = f"{prefix}{name}"
        if isinstance(value, BaseModel):
            yield from leaves(value, f"{path}.")
        else:
            yield path, value


@dataclass(frozen=True)
class Dimensions:
    """Derived values by name, such as `d["finger.thickness_mm"]`.

    Attributes:
        values: A float for each dimension by dotted name, or an array (n,) for a batch of designs.
        given: Every value of the spec by dotted path.
        fold: The solved fold of the camera's view.
    """

    values: Mapping[str, Any]
    given: Mapping[str, Any]
    fold: Fold

    def __getitem__(self, name: str) -> Any:
        if name in self.values:
            return self.values[name]
        if name in self.given:
            return self.given[name]
        raise KeyError(f"no dimension or spec field is called {name}")

    def argument(self, parameter: str) -> tuple[str, Any]:
        """Dotted name and value of a function parameter such as `gel_length_mm`."""
        entry = REGISTRY.get(parameter)
        if entry is not None:
            return entry.name, self.fold if entry.internal else self.values[entry.name]
        path = PATHS[parameter]
        return path, self.given[path]

    def inputs(self, name: str) -> tuple[tuple[str, Any], ...]:
        """Names and values of the inputs of a dimension, spec fields among them."""
        entry = definition(name)
        return tuple(self.argument(p) for p in entry.inputs)

    def feasible(self) -> Any:
        """Whether the fold keeps every limit."""
        return self.fold.worst() <= 1e-6


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
    computed = _evaluate(given)
    fold = computed.pop("fold.layout")
    values = {name: float(np.reshape(value, -1)[0]) for name, value in computed.items()}
    return Dimensions(values, given, fold)


def derive_batch(
    spec: Spec, overrides: Mapping[str, Any], *, jobs: int | None = None, among: int = 0
) -> Dimensions:
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
        computed = _evaluate(given)
    fold = computed.pop("fold.layout")
    count = max((np.size(v) for v in overrides.values()), default=1)
    values = {name: np.broadcast_to(value, (count,)) for name, value in computed.items()}
    return Dimensions(values, given, fold)


def _evaluate(given: Mapping[str, Any]) -> dict[str, Any]:
    known = {identifier(path): value for path, value in given.items()}
    results: dict[str, Any] = {}
    for entry in ORDER:
        value = entry.compute(*(known[p] for p in entry.inputs))
        known[entry.identifier] = value
        results[entry.name] = value
    return results
