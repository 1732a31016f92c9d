"""The linear screen against Sobol's indices and against variances known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import sobol_indices, uniform
from tolerance_samples import exact, spec

from gelslim_cad.dimensions import derive
from gelslim_cad.tolerance.causes import causes
from gelslim_cad.tolerance.margins import margins
from gelslim_cad.tolerance.shares import linear_shares, sobol_shares, worst_places
from gelslim_cad.tolerance.yields import sampled


def test_a_sum_of_two_errors_has_the_shares_of_its_variances() -> None:
    """Thickness: the height of the body is uniform, the gel's thickness normal."""
    d = derive(exact("mini20", manufacturing__print_tolerance_mm=0.1,
                     manufacturing__gel_thickness_tolerance_mm=0.05))  # fmt: skip
    place = "finger.thickness@back"
    expected = np.array([0.1**2 / 3, 0.05**2])
    expected = dict(zip(("printed seats", "gel"), expected / expected.sum(), strict=True))
    found = linear_shares(d, sampled(d, 4096, 0)["as_built"], place)
    first, total = sobol_shares(d, "as_built", [place], 1)[place]
    assert found.r_squared == pytest.approx(1, abs=1e-6)
    assert found.deviation == pytest.approx(np.sqrt(0.1**2 / 3 + 0.05**2), rel=1e-2)
    assert found.worst_case == pytest.approx(found.mean - 0.1 - 3 * 0.05, abs=1e-6)
    for group, share in expected.items():
        assert found.linear[group] == pytest.approx(share, abs=0.01)
        assert first[group] == pytest.approx(share, abs=0.02)
        assert total[group] == pytest.approx(share, abs=0.02)


@pytest.mark.parametrize(("name", "stage"), [("gelslim2", "as_built"), ("thin", "adjusted")])
def test_screen_and_indices_agree_where_the_margin_is_linear(name: str, stage: str) -> None:
    d = derive(spec(name))
    found = sampled(d, 8192, 0)[stage]  # type: ignore[index]
    places = worst_places(found)
    indices = sobol_shares(d, stage, places, 1)  # type: ignore[arg-type]
    compared = 0
    for place in places:
        linear = linear_shares(d, found, place)
        if linear.r_squared < 0.97:
            continue
        compared += 1
        for group, share in linear.linear.items():
            assert indices[place][0][group] == pytest.approx(share, abs=0.06), (place, group)
            assert indices[place][1][group] >= indices[place][0][group] - 0.05
    assert compared >= 4


def test_indices_by_group_are_those_of_scipy_where_each_group_is_one_cause() -> None:
    d = derive(exact("gelslim2", tolerance__lens_centring_mm=0.0,
                     tolerance__entrance_pupil_mm=0.3, tolerance__acrylic_measured_mm=0.4,
                     tolerance__lens_turn=0.1))  # fmt: skip
    place = "coverage.along@far"
    names = [c.name for c in causes(d) if c.spread > 0]
    spreads = [c.spread for c in causes(d) if c.spread > 0]
    still = {c.name: 0.0 for c in causes(d)}

    def margin(x: np.ndarray) -> np.ndarray:
        e = {k: np.full(x.shape[1], v) for k, v in still.items()}
        return margins(d, {**e, **dict(zip(names, x, strict=True))}, "as_built")[place]

    assert all(c.distribution == "uniform" for c in causes(d) if c.spread > 0)
    theirs = sobol_indices(
        func=margin, n=1024, dists=[uniform(-s, 2 * s) for s in spreads],
        random_state=np.random.default_rng(0),
    )  # fmt: skip
    first, total = sobol_shares(d, "as_built", [place], 1)[place]
    assert list(first.values()) == pytest.approx(theirs.first_order.tolist(), abs=0.03)
    assert list(total.values()) == pytest.approx(theirs.total_order.tolist(), abs=0.03)


def test_a_rule_that_nothing_moves_has_no_causes() -> None:
    d = derive(exact("gelslim2", tolerance__led_flux_percent=10.0))
    place = "blur@far"
    first, total = sobol_shares(d, "as_built", [place], 1)[place]
    assert set(first.values()) | set(total.values()) == {0.0}
    found = linear_shares(d, sampled(d, 256, 0)["as_built"], place)
    assert set(found.linear.values()) == {0.0}
