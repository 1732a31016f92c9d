"""The compiled search against its reference: same scores, same folds, any number of threads."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from fold_samples import shipped

from gelslim_cad.dimensions import derive_batch, fold_search, solver
from gelslim_cad.dimensions import view as view_module
from gelslim_cad.dimensions.fold import Fold, FoldProblem, fold

SPANS = {
    "design.gel.length_mm": (8.0, 60.0),
    "design.gel.width_mm": (8.0, 45.0),
    "design.gel.thickness_mm": (0.5, 6.0),
    "design.light_guide.thickness_mm": (1.0, 6.0),
    "camera.f_number": (1.2, 10.0),
    "camera.focal_length_mm": (1.5, 4.0),
    "camera.lens_travel_mm": (0.0, 1.5),
    "camera.module_depth_mm": (2.0, 9.0),
    "material.gel.refractive_index": (1.35, 1.6),
}
COUNT = 60


@pytest.fixture(scope="module")
def problem() -> FoldProblem:
    """Random designs, feasible and not, as the solver is given them."""
    rng = np.random.default_rng(5)
    asked: list[FoldProblem] = []
    original = view_module.solve_fold
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(view_module, "solve_fold", lambda p: asked.append(p) or original(p))
        derive_batch(shipped("mini20"), {path: rng.uniform(*s, COUNT) for path, s in SPANS.items()})
    return asked[0]


def test_scores_are_those_of_the_reference(problem: FoldProblem) -> None:
    rng = np.random.default_rng(8)
    feasible = 0
    for _ in range(40):
        mid, spread, mirror = rng.uniform(solver.LOWER, solver.UPPER, (len(problem), 3)).T
        shaped = (axis[:, None, None] for axis in (mid, spread, mirror))
        expected = np.ravel(solver.objective(fold(problem, *shaped)))
        found = fold_search.scores(problem, mid, spread, mirror)
        np.testing.assert_allclose(found, expected, rtol=1e-10)
        feasible += int((expected < solver.INFEASIBLE_MM).sum())
    assert feasible > 20


def solved(problem: FoldProblem, monkeypatch: pytest.MonkeyPatch, compiled_from: int) -> Fold:
    monkeypatch.setattr(solver, "COMPILED_FROM", compiled_from)
    return solver.solve_fold(problem)


def test_folds_are_those_of_the_reference(
    problem: FoldProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    reference = solved(problem, monkeypatch, 10**9)
    compiled = solved(problem, monkeypatch, 1)
    np.testing.assert_allclose(compiled.worst(), reference.worst(), atol=1e-6)
    good = reference.worst() < 1e-9
    assert 5 < good.sum() < COUNT
    np.testing.assert_allclose(compiled.depth_mm[good], reference.depth_mm[good], atol=1e-6)


def test_threads_do_not_change_a_bit(problem: FoldProblem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solver.os, "cpu_count", lambda: 1)
    one = solved(problem, monkeypatch, 1)
    monkeypatch.setattr(solver.os, "cpu_count", lambda: 3)
    three = solved(problem, monkeypatch, 1)
    for f in fields(Fold):
        if f.name != "violations":
            assert np.array_equal(getattr(one, f.name), getattr(three, f.name)), f.name


def test_single_designs_do_not_load_the_compiler() -> None:
    code = (
        "import sys; from fold_samples import mini20; mini20();"
        "assert 'numba' not in sys.modules and 'cadquery' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(__file__).parent)
