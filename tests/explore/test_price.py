"""The price of a changed finger against what light, dimensions and a thin layer say of it."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from explore_samples import MINI20, ROOT, mini20

from gelslim.cli import main
from gelslim_cad.checks import check
from gelslim_cad.dimensions import derive
from gelslim_cad.explore.brightness import RAYS
from gelslim_cad.explore.force_error import Patch, patch_error
from gelslim_cad.explore.pareto import FIGURES
from gelslim_cad.explore.price import Price, measured, prices
from gelslim_cad.explore.space import ExploreError, changed
from gelslim_cad.explore.thinner import LIMIT_RULE, Offer, thinner
from gelslim_cad.light.exposure import exposure
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import read_spec


@pytest.mark.parametrize("poissons_ratio", [pytest.param(0.3, marks=pytest.mark.slow), 0.4])
def test_the_stiffness_of_a_thin_layer_is_its_confined_modulus(poissons_ratio: float) -> None:
    """A bonded layer much thinner than the bump is wide only compresses: k = M / t ∫ g² dA."""
    nu, t, width = poissons_ratio, 0.2, 2.0
    confined = (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    expected = confined / t * math.pi * width**2
    found = patch_error(Patch(t, 0.7, 0.7, 2, "bbar", nu, 1.4)).press_mm
    assert found == pytest.approx(expected, rel=0.03)


def test_prices_are_what_the_tools_say_of_each_finger() -> None:
    before, after = (
        measured(read_spec(ROOT / "designs" / f"{n}.yaml").spec) for n in ("mini20", "thin")
    )
    told = {p.figure.name: p for p in prices(before, after)}
    assert list(told) == [f.name for f in FIGURES]
    mini, d = (derive(read_spec(ROOT / "designs" / f"{n}.yaml").spec) for n in ("mini20", "thin"))
    assert told["finger.thickness_mm"].after == d["finger.thickness_mm"]
    assert told["finger.thickness_mm"].verdict == "better"
    keystone = told["view.keystone"]
    assert keystone.change == pytest.approx(
        d["view.keystone"] / mini["view.keystone"] - 1, abs=1e-9
    )
    assert keystone.verdict == "worse"
    assert told["gel.area_mm2"].verdict == told["gel.stiffness_n_mm"].verdict == ""
    # Of a thinner gel of the same stuff: stiffer.
    assert told["gel.stiffness_n_mm"].change == pytest.approx(1 / 3, abs=0.05)
    from gelslim_cad.geometry.optics import guide_profile
    from gelslim_cad.light.scene import light_scene
    from gelslim_optics.light.trace import trace_light

    light = trace_light(light_scene(d, guide_profile(d)), RAYS, threads=1)
    slowest = max(exposure(d, light, c).exposure_ms for c in ("red", "green"))
    assert told["light.exposure_ms"].after == pytest.approx(slowest, rel=1e-9)


def test_a_missing_figure_has_no_change() -> None:
    assert Price(FIGURES[0], None, 2.0).change is None
    assert Price(FIGURES[0], None, 2.0).verdict == ""
    assert Price(FIGURES[0], 2.0, 2.0001).verdict == ""
    assert Price(FIGURES[3], 2.0, 1.0).verdict == "worse"


@pytest.fixture(scope="module")
def offer() -> Offer:
    return thinner(mini20(), 16.9, rays=1 << 10)


def holds(spec: Spec) -> bool:
    return not [c for c in check(derive(spec)) if c.status == "fail" and c.id != LIMIT_RULE]


@pytest.mark.slow
def test_each_concession_just_reaches_the_thickness(offer: Offer) -> None:
    reached = [c for c in offer.concessions if c.reaches]
    assert {c.path for c in reached} >= {"camera.f_number", "design.gel.length_mm"}
    for c in reached:
        spec = changed(mini20(), {c.path: c.after})
        assert holds(spec)
        assert c.thickness_mm == derive(spec)["finger.thickness_mm"] <= 16.9
        less = changed(mini20(), {c.path: c.before + 0.98 * (c.after - c.before)})
        assert not holds(less) or derive(less)["finger.thickness_mm"] > 16.9


@pytest.mark.slow
def test_what_reaches_comes_first_and_what_is_forbidden_last(offer: Offer) -> None:
    order = [(not c.reaches, bool(c.breaks)) for c in offer.concessions]
    assert order == sorted(order)
    for c in offer.concessions:
        spec = changed(mini20(), {c.path: c.after})
        assert bool(c.breaks) != holds(spec)
        assert c.thickness_mm < offer.present_mm


@pytest.mark.slow
def test_no_field_reaches_beyond_its_rules(offer: Offer) -> None:
    alone = next(c for c in offer.concessions if c.path == "design.gel.thickness_mm")
    assert not alone.reaches
    further = changed(mini20(), {alone.path: alone.after - 0.13})
    assert not holds(further)


def test_a_finger_that_is_thin_enough_or_broken_has_no_price() -> None:
    with pytest.raises(ExploreError, match=r"17\.64 mm.* 20 mm"):
        thinner(mini20(), 20.0)
    with pytest.raises(ExploreError, match=r"bezel\.thickness_mm"):
        thinner(changed(mini20(), {"design.gel.thickness_mm": 1.0}))


@pytest.mark.slow
def test_the_answer_in_words_and_for_programs(capsys: pytest.CaptureFixture[str]) -> None:
    quick = ["--rays", "1024"]
    assert main(["thinner", str(MINI20), *quick]) == 0
    words = " ".join(capsys.readouterr().out.split())
    assert "mini20 is 17.64 mm thick." in words
    assert "camera.f_number 2.9 → 4.1: 16.55 mm, 1.09 mm less costs" in words
    assert "expected force error +27.7 % (26.4 %)" in words
    assert "forbidden: breaks bezel.thickness_mm" in words
    assert main(["thinner", str(MINI20), *quick, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    stop = next(c for c in answer["concessions"] if c["path"] == "camera.f_number")
    price = {p["name"]: p for p in stop["price"]}
    assert np.isclose(price["light.exposure_ms"]["change"], 1.12, atol=0.06)
    assert main(["thinner", str(MINI20), *quick, "--to", "9"]) == 1
    assert "No field alone makes it 9 mm thick" in capsys.readouterr().out
    assert main(["thinner", str(MINI20), "--to", "20"]) == 2
    assert "no more than 20 mm" in capsys.readouterr().err


def test_diff_tells_the_price(capsys: pytest.CaptureFixture[str]) -> None:
    thin = str(ROOT / "designs" / "thin.yaml")
    assert main(["diff", str(MINI20), thin, "--no-parts"]) == 0
    table = capsys.readouterr().out.split("what it costs")[1]
    line = next(x for x in table.splitlines() if x.startswith("keystone"))
    assert line.split() == ["keystone", "1.31", "1.52", "+16.2", "%", "worse"]
    assert main(["diff", str(MINI20), thin, "--no-parts", "--no-price"]) == 0
    assert "what it costs" not in capsys.readouterr().out
