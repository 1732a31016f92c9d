"""Chunks of designs against one design at a time, through `derive` and `check`."""

from __future__ import annotations

import numpy as np
import pytest
from explore_samples import mini20, space

from gelslim_cad.checks import check, margins_batch
from gelslim_cad.checks.relaxation import given
from gelslim_cad.dimensions import derive, derive_batch
from gelslim_cad.explore.judge import SHOWN, judge
from gelslim_cad.explore.space import Axis, changed, illegal
from gelslim_cad.spec import Spec
from gelslim_core.yaml.fields import field_at, field_table


@pytest.mark.slow
@pytest.mark.parametrize(
    "vary",
    [
        ("gel.length_mm=16:28:4", "camera.f_number=2,4", "markers.diameter_mm=0.5,1.3"),
        ("housing.screw=M1.6,M2.5", "light_guide.bend_radius_ratio=auto,1.5",
         "envelope.max_width_mm=none,36"),
        pytest.param(("mesh.layers=1,4", "markers.rows=none,12"), marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_each_row_is_what_the_design_alone_gives(vary: tuple[str, ...]) -> None:
    found = space(*vary)
    rows = found.rows(0, found.count)
    columns = judge(found.spec, found.axes, rows, ("led.count",))
    assert {len(c) for c in columns.values()} == {len(rows)}
    statuses = set()
    for k, row in enumerate(rows):
        values = dict(zip((a.path for a in found.axes), row, strict=True))
        statuses.add(columns["status"][k])
        if illegal(found.spec, values):
            assert columns["status"][k] == "illegal"
            assert columns["reason"][k]
            assert columns["finger.thickness_mm"][k] is None
            continue
        d = derive(changed(found.spec, values))
        failed = {c.id for c in check(d) if c.status == "fail"}
        assert set(columns["failed"][k].split()) == failed
        assert columns["status"][k] == ("infeasible" if failed else "feasible")
        for name in (*SHOWN, "led.count"):
            assert columns[name][k] == pytest.approx(d[name], rel=1e-6, abs=1e-6), name
    assert "feasible" in statuses


def test_the_binding_rule_is_one_that_fails() -> None:
    found = space("gel.length_mm=16:28:4", "gel.thickness_mm=1.5,2", "camera.f_number=2,4")
    columns = judge(found.spec, found.axes, found.rows(0, found.count))
    for status, binding, failed in zip(
        columns["status"], columns["binding"], columns["failed"], strict=True
    ):
        names = failed.split()
        if status == "infeasible" and "fold.feasible" not in names:
            assert binding in names
    assert "bezel.thickness_mm" in columns["binding"]
    assert "finger.thickness_mm" in columns["binding"]


def test_a_fold_that_fails_names_its_limit() -> None:
    found = space("gel.length_mm=50,60")
    columns = judge(found.spec, found.axes, found.rows(0, 2))
    worst = derive(changed(mini20(), {"design.gel.length_mm": 50.0})).fold.violations
    assert max(worst, key=lambda n: float(worst[n].flat[0])) == "pixels per marker"
    assert columns["binding"][0] == "the pixels per marker at the far edge"
    assert "fold.feasible" in columns["failed"][0]


def test_margins_are_negative_exactly_where_rules_fail() -> None:
    rng = np.random.default_rng(3)
    batch = derive_batch(
        mini20(),
        {
            "design.gel.length_mm": rng.uniform(12, 40, 60),
            "design.gel.thickness_mm": rng.uniform(1, 4, 60),
            "camera.f_number": rng.uniform(1.5, 8, 60),
        },
        jobs=1,
    )
    margins = margins_batch(batch)
    assert any((room < 0).any() for room in margins.values())
    alone = {c.id: c for c in check(derive(mini20()))}
    single = margins_batch(derive_batch(mini20(), {"camera.f_number": np.array([2.9])}))
    for rule, c in alone.items():
        if c.margin is not None and c.status == "pass" and c.limit is not None:
            expected = c.margin / max(abs(c.limit), 1.0)
            assert single[rule][0] == pytest.approx(expected, rel=1e-3, abs=1e-5), rule


@pytest.mark.slow
def test_every_numeric_field_of_the_spec_can_vary() -> None:
    spec, varied = mini20(), 0
    for field in field_table(Spec):
        here = given(spec, field.path) if field_at(Spec, field.path) else None
        if isinstance(here, bool | str) or not isinstance(here, int | float):
            continue
        further = here + 1 if float not in field.types else here * 1.03 or 0.1
        values = [v for v in (here, further) if not illegal(spec, {field.path: v})]
        columns = judge(spec, [Axis(field.path, tuple(values))], [(v,) for v in values])
        for k, value in enumerate(values):
            d = derive(changed(spec, {field.path: value}))
            failed = {c.id for c in check(d) if c.status == "fail"}
            assert set(columns["failed"][k].split()) == failed, field.path
            for name in SHOWN:
                assert columns[name][k] == pytest.approx(d[name], rel=1e-6, abs=1e-6), field.path
        varied += len(values) == 2
    assert varied > 70
