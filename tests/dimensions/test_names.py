"""Names of dimensions, spec fields and rules are held by the type checker and the registries."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any, get_type_hints

import pytest

from gelslim_cad.checks import Finding
from gelslim_cad.checks.rule import RULES, rule
from gelslim_cad.dimensions.dimensions import PATHS
from gelslim_cad.dimensions.fold.fold import Fold
from gelslim_cad.dimensions.registry import REGISTRY, UNITS, Real, dimension
from gelslim_cad.electronics.circuit import Circuit, Circuits
from gelslim_cad.geometry.frame_plate import Deflection

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import dimension_names  # noqa: E402

SNIPPET = """\
from gelslim_cad.checks import check, margins_batch
from gelslim_cad.dimensions import derive, derive_batch
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.spec.reader import read_spec

spec = read_spec("finger.yaml").spec
d, batch = derive(spec), derive_batch(spec, {})
a: float = d["shim.compressed_mm"] + d["design.gel.length_mm"]
b: int = d["camera.image_width_px"]
c: bool = check(d).of("fold.feasible").margin is None
d["shim.compresed_mm"]  # refused
d["shim.compressed_m"]  # refused
d["gel.length_mm"]  # refused
b = d["design.gel.length_mm"]  # refused
batch["finger.thickness_um"]  # refused
check(d).of("fold.feasable")  # refused
margins_batch(batch)["gel.crown_um"]  # refused


def look_up(values: Lookup) -> float:
    return values["guide.bend_ration"]  # refused
"""


def test_written_names_are_those_of_the_registries() -> None:
    assert dimension_names.NAMES.read_text(encoding="utf-8") == dimension_names.names_text()
    assert dimension_names.RULE_IDS.read_text(encoding="utf-8") == dimension_names.rule_ids_text()


@pytest.mark.slow
def test_type_checker_refuses_unknown_names(tmp_path: Path) -> None:
    from mypy import api

    file = tmp_path / "snippet.py"
    file.write_text(SNIPPET, encoding="utf-8")
    config, cache = ROOT / "pyproject.toml", ROOT / ".mypy_cache"
    options = ["--config-file", str(config), "--cache-dir", str(cache), "--no-color-output"]
    output, _, _ = api.run([*options, str(file)])
    found = {int(line) for line in re.findall(r"snippet\.py:(\d+): error", output)}
    lines = SNIPPET.splitlines()
    assert found == {n for n, line in enumerate(lines, 1) if line.endswith("# refused")}


def test_every_parameter_is_a_dimension_or_a_field() -> None:
    known = REGISTRY.keys() | PATHS.keys()
    for entry in (*REGISTRY.values(), *RULES.values()):
        assert set(entry.inputs) <= known


def test_every_unit_of_a_length_or_angle_is_known() -> None:
    plain = {
        "ratio",
        "count",
        "keystone",
        "use",
        "rows",
        "columns",
        "x",
        "y",
        "layout",
        "preloaded",
        "circuit",
        "circuits",
        "series",
        "frame",
        "k1",
        "tan",
    }
    for entry in REGISTRY.values():
        assert entry.name.rsplit("_", 1)[-1].rsplit(".", 1)[-1] in UNITS.keys() | plain


def test_registries_refuse_unknown_parameters_and_names(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gelslim_cad.checks.rule.RULES", {})
    words = {"title": "t", "why": "w", "advice": "a"}

    def judge(gel_length_m: Any) -> Finding:
        return Finding(gel_length_m, 1.0)

    with pytest.raises(ValueError, match="gel_length_m"):
        rule("fold.feasible", parameter="design.gel.length_mm", **words)(judge)
    with pytest.raises(ValueError, match=r"design\.gel\.length_m,"):
        rule("fold.feasible", parameter="design.gel.length_m", **words)(lambda: Finding(0.0, 1.0))
    with pytest.raises(ValueError, match="other_length_mm"):
        dimension("other.length_mm", formula="")(judge)


def test_cyclic_or_open_dimensions_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    from gelslim_cad.dimensions import dimensions, registry

    entries: dict[str, registry.Dimension] = {}
    monkeypatch.setattr(registry, "REGISTRY", entries)
    monkeypatch.setattr(dimensions, "REGISTRY", entries)

    def loose_first_mm(loose_second_mm: Any) -> Any:
        return loose_second_mm

    def loose_second_mm(loose_first_mm: Any) -> Any:
        return loose_first_mm

    registry.dimension("loose.first_mm", formula="")(loose_first_mm)
    with pytest.raises(ValueError, match="loose_second_mm"):
        dimensions._ordered()
    registry.dimension("loose.second_mm", formula="")(loose_second_mm)
    with pytest.raises(ValueError, match="loose_first_mm"):
        dimensions._ordered()


def expected_type(parameter: str) -> object:
    """The type of a parameter's values: of one design, or arrays of n designs."""
    internal = {"fold_layout": Fold, "bezel_frame": Deflection, "electronics_circuits": Circuits}
    if parameter in internal:
        return internal[parameter]
    if parameter.endswith("_circuit"):
        return Circuit | None
    if parameter in REGISTRY:
        return Real
    kind = dimension_names._kind(PATHS[parameter])
    return {
        "FloatName": Real,
        "IntName": Real,
        "BoolName": bool,
        "TextName": str,
        "FloatsName": tuple[float, ...],
        "OptionalFloatName": Real | None,
        "OptionalIntName": Real | None,
    }[kind]


def test_parameters_of_dimensions_and_rules_have_the_types_of_their_values() -> None:
    functions = [entry.compute for entry in REGISTRY.values()]
    functions += [entry.judge for entry in RULES.values()]
    seen = 0
    for function in functions:
        hints = get_type_hints(function)
        returned = hints.pop("return")
        assert returned in (Real, Fold, Deflection, Circuit | None, Circuits, Finding), function
        if "values" in hints:  # one mapping of many inputs
            continue
        for parameter, annotation in hints.items():
            assert annotation == expected_type(parameter), (function, parameter)
            seen += 1
    assert seen > 400
