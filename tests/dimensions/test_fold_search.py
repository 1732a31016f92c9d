"""The compiled search against its reference: same scores, same folds, any number of threads."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fold_samples import shipped
from shipped_fingers import varied

from gelslim_cad.dimensions import Dimensions, derive_batch
from gelslim_cad.dimensions import view as view_module
from gelslim_cad.dimensions.fold import search as fold_search
from gelslim_cad.dimensions.fold import solver
from gelslim_cad.dimensions.fold.fold import Fold, fold
from gelslim_cad.dimensions.fold.goal import BEYOND_MM, INFEASIBLE_MM
from gelslim_cad.dimensions.fold.grids import LOWER, UPPER
from gelslim_cad.dimensions.fold.mirror import mirror_angle_rad
from gelslim_cad.dimensions.fold.pieces import measured_by_arrays
from gelslim_cad.dimensions.fold.polish import LEAST, MOST
from gelslim_cad.dimensions.fold.problem import FoldProblem

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
FREE = {"design.envelope.max_thickness_mm": None}
COUNT = 60
IDEAL = 40
"""Designs whose lens does not distort; of the others half have Brown's, half a wide lens."""


class NotSolvedError(Exception):
    """The problem is known; its solution is not needed."""


@pytest.fixture(scope="module")
def problem() -> FoldProblem:
    """Random designs, feasible and not, as the solver is given them."""
    rng = np.random.default_rng(5)
    asked: list[FoldProblem] = []

    def spy(p: FoldProblem) -> Fold:
        asked.append(p)
        raise NotSolvedError

    overrides = {path: rng.uniform(*s, COUNT) for path, s in SPANS.items()}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(view_module, "solve_fold", spy)
        with pytest.raises(NotSolvedError):
            derive_batch(varied(shipped("mini20"), FREE), overrides)
    order = np.arange(COUNT)[:, None, None]
    bent = np.where(order < IDEAL, 0.0, rng.normal(0, 1, (COUNT, 1, 1)))
    wide = (order >= IDEAL) & (order % 2 == 0)
    return replace(
        asked[0],
        k1=0.1 * bent,
        k2=0.03 * bent,
        p2=np.where(wide, 0.0, 1e-3 * bent),
        fisheye=1.0 * wide,
    )


@pytest.mark.slow
def test_scores_are_those_of_the_reference(problem: FoldProblem) -> None:
    rng = np.random.default_rng(8)
    kept = seen = 0
    for _ in range(40):
        axes = rng.uniform(LOWER, UPPER, (len(problem), 3)).T[:, :, None]
        mid, spread, turn = axes[..., None]
        laid = fold(problem, mid, spread, mirror_angle_rad(turn, mid))
        expected = np.ravel(laid.objective(problem))
        unbeaten = np.full(len(problem), np.inf)
        found = fold_search.best_of_grids(problem.records(), *axes, unbeaten).score
        np.testing.assert_allclose(found, expected, rtol=1e-10)
        kept += int((expected < BEYOND_MM).sum())
        seen += int((expected < INFEASIBLE_MM).sum())
    assert 2 < kept < seen - 10


@pytest.mark.slow
def test_measures_are_those_of_the_reference(problem: FoldProblem) -> None:
    rng = np.random.default_rng(12)
    design = rng.integers(len(problem), size=200)
    place = rng.uniform(LEAST, MOST, (200, 3, 3))
    expected = measured_by_arrays(problem)(design, place)
    np.testing.assert_allclose(
        fold_search.measured(problem)(design, place), expected, rtol=1e-9, atol=1e-9
    )


@pytest.mark.slow
def test_the_first_best_of_a_grid_is_that_of_the_reference(problem: FoldProblem) -> None:
    rng = np.random.default_rng(9)
    for _ in range(10):
        middle = rng.uniform(LOWER, UPPER, (len(problem), 3)).T[:, :, None]
        width = ((UPPER - LOWER) * 0.2)[:, None, None]
        axes = np.clip(
            middle + np.linspace(-1, 1, 5) * width, LOWER[:, None, None], UPPER[:, None, None]
        )
        unbeaten = np.full(len(problem), np.inf)
        expected = solver.best_of_grids(problem, *axes, unbeaten)
        for known in (unbeaten, expected.score * (1 + 1e-9)):
            found = fold_search.best_of_grids(problem.records(), *axes, known)
            np.testing.assert_allclose(found.score, expected.score, rtol=1e-10)
            for ours, theirs in zip(found[:3], expected[:3], strict=True):
                np.testing.assert_array_equal(ours, theirs)


def test_repeated_values_of_an_axis_are_those_like_the_one_before() -> None:
    axis = np.array([1.0, 1.0, 2.0, 3.0, 3.0, 3.0])
    assert [bool(fold_search.repeats(axis, k)) for k in range(6)] == [
        False, True, False, False, True, True
    ]  # fmt: skip
    assert not fold_search.repeats(np.array([2.0, 3.0, 2.0]), 0)


def solved(problem: FoldProblem, monkeypatch: pytest.MonkeyPatch, compiled_from: int) -> Fold:
    monkeypatch.setattr(solver, "COMPILED_FROM", compiled_from)
    return solver.solve_fold(problem)


@pytest.mark.slow
def test_folds_are_those_of_the_reference(
    problem: FoldProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    good = 0
    for part in (problem.rows(slice(0, IDEAL)), problem.rows(slice(IDEAL, IDEAL + 8))):
        reference = solved(part, monkeypatch, 10**9)
        compiled = solved(part, monkeypatch, 1)
        np.testing.assert_allclose(compiled.worst(), reference.worst(), atol=1e-6)
        kept = reference.worst() < 1e-9
        assert 0 < kept.sum() < len(part)
        np.testing.assert_allclose(compiled.depth_mm[kept], reference.depth_mm[kept], atol=1e-6)
        good += int(kept.sum())
    assert good > 5


def batch(count: int, jobs: int | None) -> Dimensions:
    rng = np.random.default_rng(6)
    overrides = {path: rng.uniform(*span, count) for path, span in SPANS.items()}
    return derive_batch(shipped("mini20"), overrides, jobs=jobs)


@pytest.mark.slow
def test_jobs_do_not_change_a_bit() -> None:
    count = solver.COMPILED_FROM + 37
    one = batch(count, 1)
    for jobs in (2, 3):
        other = batch(count, jobs)
        for name, value in one.values.items():
            assert np.array_equal(value, other[name]), name
        for name, missed in one.fold.violations.items():
            assert np.array_equal(missed, other.fold.violations[name]), name
    assert 0.1 < np.mean(one.feasible()) < 0.9


class Refused:
    def __init__(self, *_: object) -> None:
        raise AssertionError("a thread pool was started")


@pytest.mark.slow
def test_small_batches_and_one_job_start_no_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("concurrent.futures.ThreadPoolExecutor", Refused)
    batch(COUNT, 2)
    batch(solver.COMPILED_FROM, 1)
    with pytest.raises(AssertionError, match="thread pool"):
        batch(solver.COMPILED_FROM, 2)


def test_jobs_below_one_are_refused() -> None:
    with pytest.raises(ValueError, match="jobs is 0"):
        batch(2, 0)


def test_an_interrupted_batch_leaves_the_next_one_its_threads() -> None:
    with pytest.raises(RuntimeError), solver.threads(1):
        raise RuntimeError
    assert solver._JOBS.get() is None


def test_single_designs_do_not_load_the_compiler() -> None:
    code = (
        "import sys; sys.path.append('..'); from fold_samples import mini20;"
        "from gelslim_cad.checks import check;"
        "check(mini20());"
        "assert 'numba' not in sys.modules and 'cadquery' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(__file__).parent)
