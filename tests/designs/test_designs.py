"""The family of designs that ships: each derives, is feasible and breaks no rule."""

from __future__ import annotations

import json
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
    assert d.feasible()
    assert [c.id for c in check(d) if c.status == "fail"] == []


def test_the_family_is_whole() -> None:
    names = {p.stem for p in DESIGNS}
    assert names >= {"gelslim2", "mini20", "wide", "long50", "thin", "gelslim3_lens"}


@pytest.mark.slow
@pytest.mark.parametrize("path", DESIGNS, ids=lambda p: p.stem)
def test_design_is_built_and_proved(path: Path, tmp_path: Path) -> None:
    pytest.importorskip("cadquery", reason="building needs the [cad] extra")
    from gelslim_cad.build import build_variant

    result = build_variant(path, tmp_path / path.stem, jobs=1)
    assert [c.id for c in result.checks if c.status == "fail"] == []
    manifest = json.loads((tmp_path / path.stem / "manifest.json").read_text())
    assert len(manifest["proofs"]) > 200
    assert all(p["ok"] for p in manifest["proofs"])
