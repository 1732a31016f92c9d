"""The derivation of a value: its formulas with numbers, back to the lines of the spec."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from gelslim_cad.checks import RULES, check
from gelslim_cad.checks.rule import Rule
from gelslim_cad.dimensions import Dimensions, definition
from gelslim_cad.dimensions.bend import chosen_here
from gelslim_cad.dimensions.fold.fold import Fold
from gelslim_cad.dimensions.registry import REGISTRY, Dimension, unit_of
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import LoadedSpec, suggestion
from gelslim_core.errors import GelslimError
from gelslim_core.yaml.fields import field_at

Kind = Literal["dimension", "field", "solver", "rule"]
BEND, BEND_FIELD = "guide.bend_ratio", "design.light_guide.bend_radius_ratio"
ACTIVE = 0.004
"""A limit whose margin is less than this part of its scale is listed as active."""


class UnknownNameError(GelslimError, ValueError):
    """No dimension, rule or spec field has the name; the message suggests the closest."""


@dataclass(frozen=True)
class Node:
    """A value and what it was computed from.

    A node that occurs twice is written out the first time; then `repeated` is set and `inputs`
    is empty. `origin` is where a spec field was given: `file:line`, or `default`.
    """

    name: str
    kind: Kind
    value: Any
    unit: str
    meaning: str
    formula: str = ""
    source: str = ""
    origin: str = ""
    note: str = ""
    repeated: bool = False
    inputs: tuple[Node, ...] = ()


def explain(loaded: LoadedSpec, d: Dimensions, name: str) -> Node:
    """The tree under the dimension, rule or spec field `name`.

    Raises UnknownNameError with the closest names.
    """
    tracer = _Tracer(loaded, d)
    if name in tracer.dimensions:
        return tracer.node(name)
    if name in RULES:
        if RULES[name].of_markers and d.given["design.markers.pattern"] == "none":
            raise UnknownNameError(
                f"the rule {name} does not apply: the gel has no markers "
                "(design.markers.pattern = none)"
            )
        return tracer.rule(name)
    for path in (name, f"design.{name}"):
        if path in d.given:
            return replace(tracer.node(path), note=_used_by(d, path))
    known = dict.fromkeys((*d.values, *d.given, *RULES))
    hint = suggestion(name, known, "`gelslim derive` lists all dimensions")
    raise UnknownNameError(f"no dimension, rule or spec field is called {name}; {hint}")


class _Tracer:
    """Collects the tree of inputs; each value is expanded only once."""

    def __init__(self, loaded: LoadedSpec, d: Dimensions) -> None:
        self.loaded = loaded
        self.d = d
        self.dimensions = {entry.name for entry in REGISTRY.values()}
        self.seen: set[str] = set()

    def node(self, name: str) -> Node:
        if name not in self.dimensions:
            return self._field(name)
        entry = definition(name)
        kind: Kind = "solver" if entry.internal else "dimension"
        value = None if entry.internal else self.d.value(name)
        first = name not in self.seen
        self.seen.add(name)
        return Node(
            name,
            kind,
            value,
            entry.unit,
            entry.title,
            formula=entry.formula,
            source=entry.source,
            note=_active_limits(self.d.fold) if entry.name == "fold.layout" else "",
            repeated=not first,
            inputs=self._inputs(self._used_inputs(entry)) if first else (),
        )

    def _used_inputs(self, entry: Dimension) -> tuple[str, ...]:
        """The inputs that the value depends on; a bend ratio in the spec depends on no light."""
        if entry.name == BEND and not chosen_here(self.d.given[BEND_FIELD]):
            return tuple(p for p in entry.inputs if self.d.argument(p)[0] == BEND_FIELD)
        return entry.inputs

    def rule(self, name: str) -> Node:
        entry = next(entry for entry in RULES.values() if entry.id == name)
        result = check(self.d).of(entry.id)
        limit = "" if result.limit is None else f", limit {result.limit:.4g} {result.unit}".rstrip()
        return Node(
            name,
            "rule",
            result.value,
            result.unit,
            entry.title,
            formula=f"{entry.title}: {result.status}{limit}",
            note=entry.why,
            inputs=self._inputs(entry.inputs),
        )

    def _inputs(self, parameters: tuple[str, ...]) -> tuple[Node, ...]:
        return tuple(self.node(self.d.argument(p)[0]) for p in parameters)

    def _field(self, path: str) -> Node:
        place = self.loaded.source_map.get(path)
        origin = self.loaded.lent.get(path, "default")
        if place is not None:
            origin = f"{self.loaded.path}:{place.line}"
        described = field_at(Spec, path)
        return Node(
            path,
            "field",
            self.d.given[path],
            unit_of(path),
            described.description if described else "",
            origin=origin,
        )


def _used_by(d: Dimensions, path: str) -> str:
    """The dimensions and rules that use the field directly."""
    entries: tuple[Dimension | Rule, ...] = (*REGISTRY.values(), *RULES.values())
    users = [
        entry.id if isinstance(entry, Rule) else entry.name
        for entry in entries
        if path in (d.argument(p)[0] for p in entry.inputs)
    ]
    return "Used by: " + (", ".join(dict.fromkeys(users)) or "the files only")


def _active_limits(fold: Fold) -> str:
    missed = [n for n, v in fold.violations.items() if float(v.flat[0]) > 1e-6]
    if missed:
        return "no fold keeps every limit; missed: " + ", ".join(missed)
    active = [n for n, v in fold.violations.items() if float(v.flat[0]) > -ACTIVE]
    return "limits at work: " + (", ".join(active) or "none")
