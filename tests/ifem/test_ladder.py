"""The ladder: measured errors fall along it, budgets choose, and bundles carry it safely."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ifem_bundles import MARKERS

from ifem_export.bundle import build_bundle
from ifem_export.bundle_io import load_bundle, write_bundle
from ifem_export.errors import BundleError, IfemError
from ifem_export.ladder import BudgetError, Ladder, lumped, measure_ladder, refined
from ifem_export.material import Material
from ifem_export.outline import RoundedRectangle
from ifem_export.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.surface_operator import surface_operator

GEL = Material(0.147, 0.3223, 1020.0)


def pad(layers: int = 4) -> PadMesh:
    return build_pad_mesh(RoundedRectangle(16.0, 14.0, 2.0), 2.0, pitch_mm=0.8, layers=layers)[0]


@pytest.fixture(scope="module")
def ladder() -> Ladder:
    return measure_ladder(pad(), GEL, "bbar")


def error(ladder: Ladder, label: str) -> float:
    return next(r for r in ladder.rungs if r.label == label).error_field


def test_errors_fall_from_the_paper_to_condensation(ladder: Ladder) -> None:
    assert error(ladder, "paper") > 0.2
    assert error(ladder, "pcg (rtol 0.01)") < 0.05
    assert error(ladder, "pcg (rtol 0.0001)") == pytest.approx(error(ladder, "factor"), rel=0.02)
    for rung in ladder.rungs:
        assert rung.milliseconds > 0
        assert rung.n_bytes > 0
    exact = next(r for r in ladder.rungs if r.rung == "factor")
    assert exact.error_operator < 1e-6


def test_noise_gains_are_those_of_the_operator(ladder: Ladder) -> None:
    mesh = pad()
    operator = surface_operator(mesh, GEL, "bbar", "factor")
    count = len(mesh.surface)
    columns = np.zeros((2, count, 3))
    columns[0, count // 2, 0] = columns[1, count // 2, 2] = 1.0
    # The variance of a component is the sum of squares of a row of S, which is symmetric.
    rows = [np.linalg.norm(operator.force(c)) for c in columns]
    found = next(r for r in ladder.rungs if r.rung == "factor")
    assert 0.6 * min(rows) < found.noise_node_n_per_mm < 1.4 * max(rows)
    assert found.noise_resultant_n_per_mm > 0


def test_the_resultant_of_the_paper_is_right_and_its_field_is_not(ladder: Ladder) -> None:
    paper = next(r for r in ladder.rungs if r.rung == "paper")
    assert paper.error_resultant < 0.1
    assert paper.error_field > 4 * paper.error_resultant


def halved(mesh: PadMesh) -> PadMesh:
    cells = np.asarray(mesh.occupancy).repeat(2, 0).repeat(2, 1).repeat(2, 2)
    hx, hy, hz = mesh.cell_size_mm
    return PadMesh.from_occupancy(cells, (hx / 2, hy / 2, hz / 2), mesh.origin_mm)


def test_halving_cells_quarters_the_error_of_the_field() -> None:
    coarse, _ = build_pad_mesh(RoundedRectangle(16.0, 14.0, 0.0), 4.0, cells=(16, 14, 4))
    middle = halved(coarse)
    fine = halved(middle)

    def force(mesh: PadMesh) -> np.ndarray:
        points = np.asarray(mesh.nodes_mm)[mesh.surface]
        bump = np.exp(-(points[:, 0] ** 2 + points[:, 1] ** 2) / 8)
        u = bump[:, None] * np.array([0.3, 0.0, -1.0])
        return surface_operator(mesh, GEL, "bbar", "pcg", rtol=1e-8).force(u)

    best = lumped(lumped(force(fine), fine, middle), middle, coarse)
    errors = [
        np.linalg.norm(found - best)
        for found in (force(coarse), lumped(force(middle), middle, coarse))
    ]
    # Against the finest of three, h² gives log2((1 - 1/16) / (1/4 - 1/16)) = 2.3.
    assert 1.9 < np.log2(errors[0] / errors[1]) < 2.8


def test_more_layers_err_less() -> None:
    errors = [
        next(r.error_field for r in measure_ladder(pad(n), GEL, "bbar").rungs if r.rung == "factor")
        for n in (2, 4)
    ]
    assert errors[1] < 0.6 * errors[0]


def test_lumping_keeps_the_resultant() -> None:
    mesh = pad()
    fine = refined(mesh)
    force = np.random.default_rng(0).normal(size=(len(fine.surface), 3))
    np.testing.assert_allclose(lumped(force, fine, mesh).sum(axis=0), force.sum(axis=0), atol=1e-9)


def test_budgets_choose(ladder: Ladder) -> None:
    timed = [replace(r, milliseconds=float(k + 1)) for k, r in enumerate(ladder.rungs)]
    known = replace(ladder, rungs=tuple(timed))
    lumped_fft = error(ladder, "fft (lumped 1)")
    assert error(ladder, "pcg (rtol 0.01)") < lumped_fft < 0.05
    assert known.within_error(0.05).label == "fft (lumped 1)"
    assert known.within_error(0.99 * lumped_fft).label == "pcg (rtol 0.01)"
    assert known.within_time(1.5).rung == "paper"
    assert known.within_time(100.0).error_field == min(r.error_field for r in known.rungs)
    with pytest.raises(BudgetError, match=r"the most accurate, .* has"):
        known.within_error(1e-6)
    with pytest.raises(BudgetError, match="the quickest, paper, takes 1"):
        known.within_time(0.5)


def test_the_record_reads_back(ladder: Ladder) -> None:
    text = json.dumps(ladder.to_record(), allow_nan=False)
    assert Ladder.from_record(json.loads(text)) == ladder
    with pytest.raises(IfemError, match="malformed"):
        Ladder.from_record({"rungs": [{}]})


def test_a_bundle_carries_its_ladder_and_chooses_at_load(ladder: Ladder, tmp_path: Path) -> None:
    made = build_bundle(
        pad(),
        GEL,
        "bbar",
        marker_positions_mm=MARKERS,
        with_stiffness=False,
        ladder=ladder,
        operator="fft",
    )
    write_bundle(tmp_path / "b", made)
    loaded = load_bundle(tmp_path / "b")
    assert loaded.ladder == ladder
    assert loaded.surface_operator().name == "fft"
    assert loaded.surface_operator(error=0.05).name == ladder.within_error(0.05).rung
    assert loaded.surface_operator(error=0.035).name in ("pcg", "factor")
    assert loaded.surface_operator("paper").name == "paper"
    with pytest.raises(BudgetError, match="takes 1e-06 ms or less"):
        loaded.surface_operator(error=0.05, time_ms=1e-6)
    bare = build_bundle(pad(), GEL, "bbar", with_stiffness=False)
    assert bare.surface_operator().name == "pcg"
    with pytest.raises(IfemError, match="no measured ladder"):
        bare.surface_operator(error=0.05)


def test_an_altered_ladder_is_refused(ladder: Ladder, tmp_path: Path) -> None:
    made = build_bundle(pad(), GEL, "bbar", with_stiffness=False, ladder=ladder)
    write_bundle(tmp_path / "b", made)
    path = tmp_path / "b" / "ladder.json"
    path.write_text(path.read_text().replace("paper", "papet"))
    with pytest.raises(BundleError, match="SHA-256 differs"):
        load_bundle(tmp_path / "b")
    path.unlink()
    with pytest.raises(BundleError, match="cannot be read"):
        load_bundle(tmp_path / "b")


def test_a_bundle_starts_with_the_quickest_rung_near_the_best(ladder: Ladder) -> None:
    allowed = max(0.03, 1.1 * min(r.error_field for r in ladder.rungs))
    start = ladder.balanced()
    assert start.error_field <= allowed
    quicker = [r for r in ladder.rungs if r.milliseconds < start.milliseconds]
    assert all(r.error_field > allowed for r in quicker)
