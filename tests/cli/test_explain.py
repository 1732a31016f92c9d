"""The chain of formulas: every number follows from those below it, down to the spec's lines."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from cli_samples import MINI20
from ruamel.yaml import YAML

from gelslim_cad.checks import RULES
from gelslim_cad.checks.explain import Node, UnknownNameError, explain
from gelslim_cad.dimensions import definition, derive
from gelslim_cad.spec.reader import read_spec

LOADED = read_spec(MINI20)
DIMENSIONS = derive(LOADED.spec)


def walk(node: Node) -> Iterator[Node]:
    yield node
    for child in node.inputs:
        yield from walk(child)


@pytest.mark.parametrize("name", sorted(DIMENSIONS.values))
def test_each_value_follows_from_its_inputs(name: str) -> None:
    for node in walk(explain(LOADED, DIMENSIONS, name)):
        if node.kind != "dimension" or node.repeated:
            continue
        if node.name == "guide.bend_ratio":
            # Given, so the light that an automatic one is chosen for is not listed.
            assert [(c.name, c.value) for c in node.inputs] == [
                ("design.light_guide.bend_radius_ratio", node.value)
            ]
            continue
        given = [DIMENSIONS.solved[c.name] if c.kind == "solver" else c.value for c in node.inputs]
        again = definition(node.name).compute(*given)
        assert float(again if not hasattr(again, "flat") else again.flat[0]) == pytest.approx(
            node.value, rel=1e-12, abs=1e-12
        )
        assert node.formula


def test_each_node_is_written_out_once_and_leaves_are_fields() -> None:
    nodes = list(walk(explain(LOADED, DIMENSIONS, "finger.length_mm")))
    first = [n.name for n in nodes if n.kind in ("dimension", "solver") and not n.repeated]
    assert len(first) == len(set(first))
    assert any(n.repeated for n in nodes)
    for node in nodes:
        if not node.inputs and not node.repeated:
            assert node.kind == "field"
        seen_before = nodes[: nodes.index(node)]
        if node.repeated:
            assert any(n.name == node.name for n in seen_before)


def test_fields_point_to_their_line_or_to_the_default() -> None:
    lines = Path(MINI20).read_text(encoding="utf-8").splitlines()
    fields = [n for n in walk(explain(LOADED, DIMENSIONS, "finger.thickness_mm")) if n.origin]
    given = [n for n in fields if n.origin != "default"]
    assert len(given) > 5
    assert len(given) < len(fields)
    for node in given:
        path, _, line = node.origin.rpartition(":")
        assert path == str(MINI20)
        key, _, value = lines[int(line) - 1].strip().partition(":")
        assert key == node.name.rpartition(".")[2]
        assert YAML(typ="safe").load(value) == node.value
    assert {n.name for n in fields if n.origin == "default"} <= set(LOADED.defaulted)


@pytest.mark.parametrize("name", sorted(RULES))
def test_every_rule_can_be_explained(name: str) -> None:
    node = explain(LOADED, DIMENSIONS, name)
    # A rule on a dimension may carry the dimension's name, which then is explained.
    expected = definition(name).inputs if name in DIMENSIONS.values else RULES[name].inputs
    given_bend = name == "guide.bend_ratio"  # nothing but the field then
    assert len(node.inputs) == (1 if given_bend else len(expected))
    assert node.kind == ("dimension" if name in DIMENSIONS.values else "rule")


def test_the_solver_tells_which_limits_are_at_work() -> None:
    nodes = walk(explain(LOADED, DIMENSIONS, "view.keystone"))
    solver = next(n for n in nodes if n.kind == "solver")
    assert "blur" in solver.note
    assert "field of view along" in solver.note


def test_a_field_names_its_users_and_may_leave_out_design() -> None:
    node = explain(LOADED, DIMENSIONS, "leds.package_mm")
    assert node.name == "design.leds.package_mm"
    assert "led.fits_mm" in node.note
    unused = explain(LOADED, DIMENSIONS, "camera.frame_rate_hz")
    assert unused.note == "Used by: the files only"


@pytest.mark.parametrize(
    ("name", "suggestion"),
    [
        ("finger.thicknes_mm", "finger.thickness_mm"),
        ("mirror.angle", "mirror.angle_deg"),
        ("design.gel.lenght_mm", "design.gel.length_mm"),
        ("blur.gell", "blur.gel"),
    ],
)
def test_unknown_names_suggest_the_closest(name: str, suggestion: str) -> None:
    with pytest.raises(UnknownNameError, match="did you mean") as caught:
        explain(LOADED, DIMENSIONS, name)
    assert suggestion in str(caught.value)
