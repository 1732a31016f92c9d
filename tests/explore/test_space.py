"""Axes and the designs they span."""

from __future__ import annotations

import itertools

import pytest
from explore_samples import mini20, space

from gelslim_cad.explore.space import (
    CHUNK,
    ExploreError,
    Space,
    changed,
    grouped,
    illegal,
    parse_axis,
)


@pytest.mark.parametrize(
    ("text", "path", "values"),
    [
        ("design.gel.length_mm=16:50:1", "design.gel.length_mm", tuple(map(float, range(16, 51)))),
        ("gel.length_mm=1:2:0.1", "design.gel.length_mm",
         tuple(round(1 + 0.1 * k, 10) for k in range(11))),
        ("gel.length_mm=5:4:-0.4", "design.gel.length_mm", (5.0, 4.6, 4.2)),
        ("camera.f_number=2, 2.9,4", "camera.f_number", (2.0, 2.9, 4.0)),
        ("mesh.layers=1:4:1", "mesh.layers", (1, 2, 3, 4)),
        ("light_guide.bend_radius_ratio=auto,2.1", "design.light_guide.bend_radius_ratio",
         ("auto", 2.1)),
        ("envelope.max_width_mm=none,40", "design.envelope.max_width_mm", (None, 40.0)),
        ("housing.screw=M1.6,M2", "design.housing.screw", ("M1.6", "M2")),
    ],
)  # fmt: skip
def test_axes(text: str, path: str, values: tuple[object, ...]) -> None:
    axis = parse_axis(text)
    assert (axis.path, axis.values) == (path, values)
    assert [type(v) for v in axis.values] == [type(v) for v in values]


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("gel.lenght_mm=1,2", "did you mean design.gel.length_mm"),
        ("gel.length_mm", "no values"),
        ("gel.length_mm=", "no values"),
        ("gel.length_mm=1:2", "three numbers"),
        ("gel.length_mm=1:2:0", "does not lead"),
        ("gel.length_mm=1:2:-1", "does not lead"),
        ("gel.length_mm=0:1:1e-9", "at most"),
        ("gel.length_mm=1,one", "no number"),
        ("gel.length_mm=nan", "no number"),
        ("gel.length_mm=3,3.0", "twice"),
        ("mesh.layers=1.5", "whole numbers"),
        ("housing.screw=M9", "M1.6, M2, M2.5"),
        ("camera.f_number=none", "no number"),
        ("leds.emission_angle_deg=1", "cannot vary|not a field that can vary"),
        ("name=a,b", "not a field that can vary"),
        ("gel=1,2", "gel is a block"),
    ],
)
def test_what_no_axis_can_be_is_refused_with_a_remedy(text: str, word: str) -> None:
    with pytest.raises(ExploreError, match=word):
        parse_axis(text)


def test_designs_are_all_combinations_in_order() -> None:
    found = space()
    expected = list(itertools.product(*(a.values for a in found.axes)))
    assert found.rows(0, found.count) == expected
    wide = space("gel.length_mm=10:50:0.05", "camera.f_number=2,4")
    joined = [row for start, stop in wide.chunks() for row in wide.rows(start, stop)]
    assert joined == list(itertools.product(*(a.values for a in wide.axes)))
    assert all(stop - start <= CHUNK for start, stop in wide.chunks())


def test_no_axis_or_one_twice_is_refused() -> None:
    with pytest.raises(ExploreError):
        Space.of(mini20(), [])
    with pytest.raises(ExploreError, match=r"gel\.length_mm"):
        space("gel.length_mm=1,2", "design.gel.length_mm=3")
    with pytest.raises(ExploreError):
        space("gel.length_mm=10:50:0.01", "gel.width_mm=10:50:0.01")


def test_a_changed_spec_differs_in_those_fields_alone() -> None:
    spec = changed(mini20(), {"design.gel.length_mm": 22.0, "mesh.layers": 3})
    assert (spec.design.gel.length_mm, spec.mesh.layers) == (22.0, 3)
    back = changed(spec, {"design.gel.length_mm": 20.0, "mesh.layers": mini20().mesh.layers})
    assert back == mini20()


def test_illegal_values_are_told_in_the_specs_words() -> None:
    assert illegal(mini20(), {"design.gel.length_mm": 22.0}) == ""
    assert "merge" in illegal(mini20(), {"design.markers.diameter_mm": 1.3})
    assert "design.gel.length_mm" in illegal(mini20(), {"design.gel.length_mm": 500.0})


def test_groups_hold_every_row_once() -> None:
    found = space("gel.length_mm=16,18", "housing.screw=M1.6,M2", "camera.f_number=2,4")
    rows = found.rows(0, found.count)
    seen = []
    for fixed, columns, places in grouped(found.axes, rows):
        for k, place in enumerate(places):
            row = dict(zip((a.path for a in found.axes), rows[place], strict=True))
            assert row == {**fixed, **{p: v[k] for p, v in columns.items()}}
            seen.append(place)
    assert sorted(seen) == list(range(found.count))
