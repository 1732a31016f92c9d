"""The shipped designs, with fields changed, with their dimensions and solids."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.part import Part
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import read_spec

DESIGNS = sorted((Path(__file__).parents[1] / "designs").glob("*.yaml"))
NAMES = [path.stem for path in DESIGNS]


def varied(spec: Spec, changes: dict[str, Any]) -> Spec:
    """`spec` with fields replaced by their dotted paths, validated anew."""
    data = spec.model_dump()
    for path, value in changes.items():
        *blocks, name = path.split(".")
        block = data
        for key in blocks:
            block = block[key]
        assert name in block, path
        block[name] = value
    return Spec(**data)


@cache
def dimensions(name: str) -> Dimensions:
    return derive(read_spec(DESIGNS[NAMES.index(name)]).spec)


@cache
def parts(name: str) -> tuple[Part, ...]:
    """Needs the CAD kernel."""
    from gelslim_cad.solids.finger import finger_parts

    return finger_parts(dimensions(name))
