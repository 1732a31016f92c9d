"""A small space that holds feasible, infeasible and illegal designs."""

from __future__ import annotations

from pathlib import Path

from gelslim_cad.explore.space import Space, parse_axis
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import read_spec

ROOT = Path(__file__).parents[2]
MINI20 = ROOT / "designs" / "mini20.yaml"
VARY = ("gel.length_mm=16:28:4", "camera.f_number=2,4", "markers.diameter_mm=0.5,1.3")


def mini20() -> Spec:
    return read_spec(MINI20).spec


def space(*vary: str) -> Space:
    return Space.of(mini20(), [parse_axis(v) for v in vary or VARY])
