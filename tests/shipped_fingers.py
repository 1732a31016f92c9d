"""Dimensions and solids of the shipped designs, made once for all tests of a process."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.geometry.part import Part
from gelslim_cad.spec.reader import read_spec

DESIGNS = sorted((Path(__file__).parents[1] / "designs").glob("*.yaml"))
NAMES = [path.stem for path in DESIGNS]


@cache
def dimensions(name: str) -> Dimensions:
    return derive(read_spec(DESIGNS[NAMES.index(name)]).spec)


@cache
def parts(name: str) -> tuple[Part, ...]:
    """Needs the CAD kernel."""
    from gelslim_cad.solids.finger import finger_parts

    return finger_parts(dimensions(name))
