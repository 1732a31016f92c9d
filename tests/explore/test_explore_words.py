"""Axes of yes and no, short names of columns, reasons of refusals, and many small batches."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from explore_samples import MINI20, mini20, space

from gelslim.cli import main
from gelslim_cad.dimensions import derive_batch
from gelslim_cad.dimensions.fold import solver
from gelslim_cad.explore.judge import judge
from gelslim_cad.explore.space import ExploreError, parse_axis, shown
from gelslim_cad.explore.study import Request, explore
from gelslim_cad.explore.table import csv_bytes, parquet_bytes
from gelslim_cad.spec.reader import read_spec
from gelslim_cad.spec.starter import spec_text
from gelslim_core.jobs import Engine


def test_yes_and_no_vary(tmp_path: Path) -> None:
    found = space("manufacturing.fabric_skin=true,FALSE", "gel.length_mm=18")
    axis = found.axes[0]
    assert axis.values == (True, False)
    assert not axis.numeric
    assert [shown(v) for v in axis.values] == ["true", "false"]
    columns = explore(Request(found), tmp_path / "x", Engine(1)).columns
    rows = list(csv.DictReader(io.StringIO(csv_bytes(columns).decode())))
    assert [r["manufacturing.fabric_skin"] for r in rows] == ["true", "false"]
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(io.BytesIO(parquet_bytes(columns)))
    assert table["manufacturing.fabric_skin"].to_pylist() == [True, False]
    path = tmp_path / "with.yaml"
    path.write_text(spec_text(MINI20.read_text(), {"manufacturing.fabric_skin": True}))
    assert read_spec(path).spec.manufacturing.fabric_skin is True


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("manufacturing.fabric_skin=yes", r"manufacturing\.fabric_skin"),
        ("gel=1,2", r"design\.gel\.length_mm"),
        ("leds.emission_angle_deg=1", r"leds\.emission_angle_deg"),
    ],
)
def test_refusals_name_the_field(text: str, name: str) -> None:
    with pytest.raises(ExploreError, match=name):
        parse_axis(text)


def test_columns_have_the_short_names_of_axes() -> None:
    asked = Request(space(), also=("gel.width_mm", "led.count"))
    assert asked.also == ("design.gel.width_mm", "led.count")
    with pytest.raises(ExploreError, match=r"finger\.thickness_mm"):
        Request(space(), also=("finger.thicknes_mm",))


def test_a_space_of_illegal_designs_says_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib")
    command = ["explore", str(MINI20), "--vary", "gel.length_mm=1,2,900"]
    assert main([*command, "-o", str(tmp_path / "x"), "-j", "1"]) == 0
    shown_lines = capsys.readouterr().out.splitlines()
    assert shown_lines[1].split() == ["3", "refused", "by", "the", "spec"]
    assert "greater than or equal to 5" in shown_lines[2]
    assert shown_lines[2].split()[0] == "2"
    assert "less than or equal to 120" in shown_lines[3]


@pytest.mark.slow
def test_words_do_not_send_a_chunk_to_the_slow_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """Groups of a large chunk are small; each once took the search for single designs."""
    found = space("gel.length_mm=16:24:0.115", "housing.screw=M1.6,M2,M2.5")
    assert found.count / 3 < solver.COMPILED_FROM < found.count

    def slow(problem: object) -> None:
        raise AssertionError("searched one by one")

    monkeypatch.setattr(solver, "_solve_chunk", slow)
    columns = judge(found.spec, found.axes, found.rows(0, found.count))
    assert len(set(columns["status"])) == 2


@pytest.mark.slow
def test_designs_of_one_fold_are_searched_once(monkeypatch: pytest.MonkeyPatch) -> None:
    from gelslim_cad.dimensions.fold import search as fold_search

    searched = []
    original = fold_search.search

    def spy(problem: object) -> object:
        searched.append(len(problem))  # type: ignore[arg-type]
        return original(problem)  # type: ignore[arg-type]

    monkeypatch.setattr(fold_search, "search", spy)
    lengths, moduli = np.meshgrid(np.linspace(16, 24, 30), np.linspace(0.1, 0.4, 10))
    many = derive_batch(
        mini20(),
        {
            "design.gel.length_mm": lengths.ravel(),
            "material.gel.youngs_modulus_mpa": moduli.ravel(),
        },
        jobs=1,
    )
    assert sum(searched) == 30
    alone = derive_batch(mini20(), {"design.gel.length_mm": lengths[0]}, jobs=1, among=300)
    thickness = many["finger.thickness_mm"].reshape(lengths.shape)
    assert np.array_equal(thickness, np.broadcast_to(alone["finger.thickness_mm"], lengths.shape))
