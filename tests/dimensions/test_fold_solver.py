"""The fold search against a global optimiser, in batches, and in fresh processes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fold_samples import mini20, shipped
from scipy.optimize import differential_evolution
from shipped_fingers import varied

from gelslim_cad.dimensions import Dimensions, derive, derive_batch
from gelslim_cad.dimensions import view as view_module
from gelslim_cad.dimensions.fold.fold import fold
from gelslim_cad.dimensions.fold.goal import BEYOND_MM
from gelslim_cad.dimensions.fold.grids import LOWER, UPPER
from gelslim_cad.dimensions.fold.mirror import FLATTEST_RAD, STEEPEST_RAD
from gelslim_cad.dimensions.fold.problem import FoldProblem
from gelslim_cad.dimensions.fold.wishes import EQUAL_MM

SPREADS: dict[str, tuple[float, float]] = {
    "design.gel.length_mm": (12.0, 35.0),
    "design.gel.width_mm": (12.0, 30.0),
    "design.gel.thickness_mm": (1.0, 4.0),
    "design.light_guide.thickness_mm": (1.5, 5.0),
    "design.optics.blur_per_diameter": (0.2, 0.8),
    "camera.focal_length_mm": (2.5, 3.6),
    "camera.module_height_mm": (6.0, 10.0),
}


def drawn(seed: int, count: int) -> dict[str, Any]:
    rng = np.random.default_rng(seed)
    return {path: rng.uniform(*span, count) for path, span in SPREADS.items()}


def solved(changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> tuple[Any, FoldProblem]:
    """Dimensions and the fold problem that was solved for them."""
    asked: list[FoldProblem] = []
    original = view_module.solve_fold

    def spy(problem: FoldProblem) -> Any:
        asked.append(problem)
        return original(problem)

    monkeypatch.setattr(view_module, "solve_fold", spy)
    view_module._solved_alone.cache_clear()
    return mini20(changes), asked[0]


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"design.optics.blur_per_diameter": 0.25},
        {k: float(v[0]) for k, v in drawn(0, 1).items()},
        pytest.param({"design.optics.blur_per_diameter": 0.2}, marks=pytest.mark.slow),
        *(
            pytest.param(
                {k: float(v[0]) for k, v in drawn(seed, 1).items()}, marks=pytest.mark.slow
            )
            for seed in range(1, 4)
        ),
    ],
)
def test_no_global_optimiser_finds_a_thinner_fold(
    changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    d, problem = solved(changes, monkeypatch)

    def score(x: np.ndarray) -> np.ndarray:
        return fold(problem, *(axis.reshape(1, -1, 1) for axis in x)).objective(problem).reshape(-1)

    best = min(
        differential_evolution(
            score,
            [*zip(LOWER[:2], UPPER[:2], strict=True), (FLATTEST_RAD, STEEPEST_RAD)],
            seed=seed,
            popsize=30,
            maxiter=150,
            vectorized=True,
            updating="deferred",
            tol=1e-9,
            polish=False,
        ).fun
        for seed in range(2)
    )
    ours = d.fold.objective(problem).item()
    assert ours < best + EQUAL_MM + 0.005
    assert d.feasible() or best > BEYOND_MM


@pytest.mark.slow
def test_batch_equals_single_designs() -> None:
    overrides = drawn(11, 7)
    overrides["design.light_guide.bend_radius_ratio"] = np.linspace(0.8, 4, 7)
    batch = derive_batch(shipped("mini20"), overrides)
    for k in range(7):
        row = {path: float(v[k]) for path, v in overrides.items()}
        single = derive(varied(shipped("mini20"), row))
        assert set(single.values) == set(batch.values)
        for name, value in single.values.items():
            assert batch[name][k] == pytest.approx(value, rel=1e-9, abs=1e-9), name


def test_unknown_override_is_refused() -> None:
    with pytest.raises(KeyError, match=r"design\.gel\.size_mm"):
        derive_batch(shipped("mini20"), {"design.gel.size_mm": [1.0]})


@pytest.mark.slow
def test_two_fresh_processes_agree_to_the_bit() -> None:
    code = (
        "import sys; sys.path.append('..')\n"
        "from fold_samples import mini20\n"
        "d = mini20()\n"
        "print(sorted((k, float(v).hex()) for k, v in d.values.items()))"
    )
    outputs = {
        subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            check=True,
            cwd=Path(__file__).parent,
            env={"PYTHONHASHSEED": seed, "PYTHONPATH": str(Path(__file__).parents[2])},
        ).stdout
        for seed in ("1", "2")
    }
    assert len(outputs) == 1


def check_kept(d: Dimensions) -> None:
    """Feasible designs keep the limits that can be read off other dimensions."""
    ok = np.asarray(d.feasible())
    assert ok.any()
    blur = np.maximum(d["view.near_blur_mm"], d["view.far_blur_mm"]) / d["view.blur_limit_mm"]
    assert blur[ok].max() <= 1 + 1e-5
    assert d["view.across_use"][ok].max() <= 1
    assert d["view.along_use"][ok].max() <= 1
    assert np.all(d["finger.depth_mm"][ok] >= d["guide.stack_mm"][ok] - 1e-9)


@pytest.mark.slow
def test_feasible_designs_of_a_batch_keep_their_limits() -> None:
    check_kept(derive_batch(shipped("mini20"), drawn(21, 60)))


@pytest.mark.slow
def test_ten_thousand_designs_at_once() -> None:
    d = derive_batch(shipped("mini20"), drawn(22, 10_000))
    assert d["finger.thickness_mm"].shape == (10_000,)
    assert all(np.isfinite(v).all() for v in d.values.values())
    check_kept(d)


def test_a_fold_that_was_solved_before_is_taken_again_but_no_other() -> None:
    _solved_alone = view_module._solved_alone
    spec = shipped("mini20")
    first = derive(spec)
    before = _solved_alone.cache_info()
    # What the fold does not read leaves it as it is; what it reads gives another.
    again = derive(varied(spec, {"design.leds.radiant_flux_mw": 3.0}))
    other = derive(varied(spec, {"design.optics.image_margin": 0.05}))
    after = _solved_alone.cache_info()
    assert (after.hits - before.hits, after.misses - before.misses) == (1, 1)
    assert again["mirror.angle_deg"] == first["mirror.angle_deg"]
    assert other["mirror.angle_deg"] != first["mirror.angle_deg"]
    with pytest.raises(ValueError, match="read-only"):
        again.fold.depth_mm[...] = 0.0
