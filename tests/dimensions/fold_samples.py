"""Specs for the tests of dimensions: the shipped designs with fields changed by dotted path."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from shipped_fingers import varied

from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import read_spec

DESIGNS = Path(__file__).parents[2] / "designs"


USUAL = {"design.optics.image_margin": 0.015, "design.mirror.thickness_mm": 1.0}
"""Without what the shipped designs do for their yield."""


@cache
def shipped(name: str) -> Spec:
    return varied(read_spec(DESIGNS / f"{name}.yaml").spec, USUAL)


def mini20(changes: dict[str, Any] | None = None) -> Dimensions:
    return derive(varied(shipped("mini20"), changes or {}))
