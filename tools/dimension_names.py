"""Write the types of all names: spec fields and dimensions by the type of their value, and rules.

`python tools/dimension_names.py` writes `gelslim_cad/geometry/names.py` and
`gelslim_cad/checks/rule_ids.py`; `tests/dimensions/test_names.py` holds that they are up to date.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

from gelslim_cad.checks.rule import RULES
from gelslim_cad.dimensions.dimensions import PATHS
from gelslim_cad.dimensions.registry import REGISTRY
from gelslim_cad.spec import Spec

ROOT = Path(__file__).parents[1]
NAMES = ROOT / "gelslim_cad" / "geometry" / "names.py"
RULE_IDS = ROOT / "gelslim_cad" / "checks" / "rule_ids.py"
KINDS: dict[str, set[Any]] = {
    "FloatName": {float},
    "IntName": {int},
    "BoolName": {bool},
    "TextName": {str},
    "FloatsName": {tuple},
    "OptionalFloatName": {float, NoneType},
    "OptionalIntName": {int, NoneType},
    "OptionalTextName": {str, NoneType},
    "FloatOrTextName": {float, str},
}
"""The types of values by the name of the type of their names."""


def names_text() -> str:
    """The module `gelslim_cad.geometry.names`."""
    dimensions = [entry.name for entry in REGISTRY.values() if not entry.internal]
    fields: dict[str, list[str]] = {kind: [] for kind in KINDS}
    for path in PATHS.values():
        fields[_kind(path)].append(path)
    parts = [
        '"""Names of spec fields and dimensions, by the type of their value.\n\n'
        'Written by `tools/dimension_names.py`; do not edit by hand.\n"""\n',
        "from typing import Literal\n",
        _literal("DimensionName", dimensions),
        *(_literal(kind, names) for kind, names in fields.items()),
        "Name = (\n    " + "\n    | ".join(["DimensionName", *KINDS]) + "\n)",
    ]
    return "\n".join(parts) + "\n"


def rule_ids_text() -> str:
    """The module `gelslim_cad.checks.rule_ids`."""
    return "\n".join(
        [
            '"""Identifiers of the design rules.\n\n'
            'Written by `tools/dimension_names.py`; do not edit by hand.\n"""\n',
            "from typing import Literal\n",
            _literal("RuleId", RULES),
            "",
        ]
    )


def _literal(name: str, values: Iterable[str]) -> str:
    quoted = [f'"{value}"' for value in values]
    if len(quoted) == 1:
        return f"{name} = Literal[{quoted[0]}]"
    return f"{name} = Literal[\n" + "".join(f"    {value},\n" for value in quoted) + "]"


def _kind(path: str) -> str:
    *blocks, last = path.split(".")
    model: type[BaseModel] = Spec
    for block in blocks:
        inner = model.model_fields[block].annotation
        assert isinstance(inner, type)
        assert issubclass(inner, BaseModel)
        model = inner
    types = set(_types(model.model_fields[last].annotation))
    return next(kind for kind, expected in KINDS.items() if expected == types)


def _types(annotation: Any) -> Iterator[Any]:
    """The plain types that a field's annotation is made of."""
    origin = get_origin(annotation)
    if origin in (Union, UnionType):
        for part in get_args(annotation):
            yield from _types(part)
    elif origin is Annotated:
        yield from _types(get_args(annotation)[0])
    elif origin is Literal:
        yield from {type(value) for value in get_args(annotation)}
    else:
        yield origin or annotation


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.partition("\n")[0]).parse_args()
    import gelslim_cad.checks  # noqa: F401  (registers the rules)

    NAMES.write_text(names_text(), encoding="utf-8")
    RULE_IDS.write_text(rule_ids_text(), encoding="utf-8")
