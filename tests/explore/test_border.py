"""The border of what is feasible, and optima that lie on it."""

from __future__ import annotations

from pathlib import Path

import pytest
from explore_samples import mini20, space

from gelslim_cad.checks import check
from gelslim_cad.dimensions import derive
from gelslim_cad.explore.optimum import border, optimise
from gelslim_cad.explore.space import changed
from gelslim_cad.explore.study import Request
from gelslim_core.jobs import Engine


def failed(**values: float) -> set[str]:
    spec = changed(mini20(), {p.replace("__", "."): v for p, v in values.items()})
    return {c.id for c in check(derive(spec)) if c.status == "fail"}


@pytest.mark.parametrize(
    ("path", "here", "beyond", "hair"),
    [
        ("design.gel.thickness_mm", 2.0, 1.0, -0.002),
        pytest.param("design.gel.length_mm", 20.0, 26.0, 0.02, marks=pytest.mark.slow),
        pytest.param("design.housing.back_wall_mm", 1.2, 0.5, -0.002, marks=pytest.mark.slow),
        pytest.param("design.light_guide.leg_length_mm", 1.0, 0.4, -0.002, marks=pytest.mark.slow),
    ],
)
def test_a_hair_beyond_the_border_the_rule_breaks(
    path: str, here: float, beyond: float, hair: float
) -> None:
    found = border(mini20(), {path: here}, path, beyond)
    assert found is not None
    name = path.replace(".", "__")
    assert not failed(**{name: found.value})
    assert found.stops in failed(**{name: found.value + hair})


@pytest.mark.slow
def test_a_border_of_the_spec_itself_says_why() -> None:
    path = "design.markers.diameter_mm"
    found = border(mini20(), {path: 0.56}, path, 1.3)
    assert found is not None
    assert found.stops
    assert border(mini20(), {path: 0.6}, path, 0.56) is None


@pytest.mark.slow
def test_the_optimum_lies_on_its_border(tmp_path: Path) -> None:
    """A third of a step between two values of the grid was once as near as it came."""
    asked = Request(space("gel.length_mm=18,20", "gel.thickness_mm=1.5:2.5:0.5"))
    best = optimise(asked, "thin", tmp_path / "o", Engine(1), rounds=1)
    gel = best.values["design.gel.thickness_mm"]
    assert isinstance(gel, float)
    shorter = {"design__gel__length_mm": 18.0}
    assert not failed(**shorter, design__gel__thickness_mm=gel)
    assert failed(**shorter, design__gel__thickness_mm=gel - 0.004) == {"bezel.thickness_mm"}
    stop = next(n for n in best.neighbours if n.value == 1.5)
    assert stop.stops == "bezel.thickness_mm"
    assert stop.holds_to == pytest.approx(gel, abs=0.002)
    assert best.row["design.gel.thickness_mm"] == gel
