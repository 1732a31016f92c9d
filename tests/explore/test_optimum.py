"""The optimum against brute force over a finer grid, and the spec it saves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from explore_samples import MINI20, mini20, space

from gelslim_cad.checks import check, margins_batch
from gelslim_cad.dimensions import derive, derive_batch
from gelslim_cad.explore.optimum import optimise
from gelslim_cad.explore.pareto import FIGURES, TRADES, front
from gelslim_cad.explore.price import Price
from gelslim_cad.explore.space import ExploreError
from gelslim_cad.explore.study import Request
from gelslim_cad.spec.reader import read_spec
from gelslim_cad.spec.starter import spec_text
from gelslim_core.jobs import Engine


@pytest.mark.slow
def test_the_thinnest_is_no_thicker_than_brute_force(tmp_path: Path) -> None:
    asked = Request(space("gel.length_mm=18:22:2", "gel.thickness_mm=1.5:3:0.5"))
    best = optimise(asked, "thin", tmp_path / "o", Engine(1), rounds=3)
    length, thickness = np.meshgrid(np.linspace(18, 22, 9), np.linspace(1.5, 3, 31))
    batch = derive_batch(
        mini20(),
        {
            "design.gel.length_mm": length.ravel(),
            "design.gel.thickness_mm": thickness.ravel(),
        },
        jobs=1,
    )
    good = np.all([room >= 0 for room in margins_batch(batch).values()], axis=0)
    assert 0 < good.sum() < good.size
    found = best.row["finger.thickness_mm"]
    assert found <= batch["finger.thickness_mm"][good].min() + 0.02
    assert best.values["design.gel.length_mm"] == 18.0
    assert best.at_end == ("design.gel.length_mm",)
    below = next(
        n for n in best.neighbours if n.path == "design.gel.thickness_mm" and n.value == 1.5
    )
    assert (below.status, below.binding) == ("infeasible", "bezel.thickness_mm")


@pytest.mark.slow
def test_brightest_and_most_accurate_lead_their_columns(tmp_path: Path) -> None:
    asked = Request(space("camera.f_number=2.9,4", "markers.pitch_mm=1.2,1.6"), rays=1 << 11)
    bright = optimise(asked, "bright", tmp_path / "b", Engine(1), rounds=0)
    assert bright.values["camera.f_number"] == 2.9  # more light through a wider opening
    accurate = optimise(asked, "accurate", tmp_path / "a", Engine(1), rounds=0)
    assert accurate.row["force.error"] <= min(
        n.goal for n in accurate.neighbours if n.goal is not None
    )


def test_no_feasible_design_says_what_stops_most(tmp_path: Path) -> None:
    asked = Request(space("gel.length_mm=50,60"))
    with pytest.raises(ExploreError, match=r"is feasible.*pixels per marker"):
        optimise(asked, "thin", tmp_path / "o", Engine(1))


def test_the_saved_spec_keeps_comments_and_is_the_design(tmp_path: Path) -> None:
    values = {"design.gel.length_mm": 18.5, "design.housing.screw": "M1.6", "mesh.layers": 3}
    text = spec_text(MINI20.read_text(), values)
    assert "# The smallest finger of the paper" in text
    path = tmp_path / "best.yaml"
    path.write_text(text)
    spec = read_spec(path).spec
    assert (spec.design.gel.length_mm, spec.design.housing.screw, spec.mesh.layers) == (
        18.5, "M1.6", 3,
    )  # fmt: skip
    assert spec.camera == mini20().camera
    assert {c.id for c in check(derive(spec)) if c.status == "fail"} == set()


def test_the_front_is_that_of_brute_force() -> None:
    rng = np.random.default_rng(4)
    x, y = np.round(rng.uniform(1, 9, (2, 300)), 1)
    expected = {
        k
        for k in range(300)
        if not any(
            x[j] <= x[k] and y[j] <= y[k] and (x[j] < x[k] or y[j] < y[k]) for j in range(300)
        )
    }
    found = front(list(x), list(y))
    assert set(found) == expected
    assert list(x[found]) == sorted(x[found])


def test_differences_below_the_solvers_accuracy_make_no_front() -> None:
    assert front([1.0, 1.00001, 2.0], [3.0, 2.99999, 1.0]) == [0, 1, 2]
    assert front([1.0, 1.5, 2.0], [3.0, 2.99999, 1.0]) == [0, 2]


def test_a_keystone_below_one_is_a_keystone_too() -> None:
    """Far markers larger than near ones once counted as better than a view square on."""
    goal = next(g for g in TRADES if g.name == "view.keystone")
    assert goal.costs([0.8, 1.0, 1.25]) == pytest.approx([1.25, 1.0, 1.25])
    assert front([15.0, 16.0, 17.0], goal.costs([1.0, 0.96, 0.95])) == [0]
    bright = next(g for g in TRADES if g.better == "more")
    assert front([1.0, 2.0, 3.0], bright.costs([5.0, 4.0, 6.0])) == [0, 2]
    keystone = next(f for f in FIGURES if f.name == "view.keystone")
    assert Price(keystone, 1.02, 0.9).verdict == "worse"
    assert Price(keystone, 0.9, 1.02).verdict == "better"
    assert Price(keystone, 1.2, 1.3).verdict == "worse"
