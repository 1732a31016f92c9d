"""The family of designs that ships: each derives, is feasible and breaks no rule."""

from __future__ import annotations

from pathlib import Path

import pytest

from gelslim_cad.checks import check
from gelslim_cad.dimensions import derive
from gelslim_cad.spec.reader import read_spec

DESIGNS = sorted((Path(__file__).parents[2] / "designs").glob("*.yaml"))


@pytest.mark.parametrize("path", DESIGNS, ids=lambda p: p.stem)
def test_design_is_feasible_and_breaks_no_rule(path: Path) -> None:
    loaded = read_spec(path)
    d = derive(loaded.spec)
    assert loaded.spec.name == path.stem
    assert bool(d.feasible().all())
    assert [c.id for c in check(d) if c.status == "fail"] == []


def test_the_family_is_whole() -> None:
    names = {p.stem for p in DESIGNS}
    assert names >= {"gelslim2", "mini20", "wide", "long50", "thin", "gelslim3_lens"}
