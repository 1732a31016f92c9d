"""Rules on printed parts: what fails, what warns, for which process, and what the printer reads."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gelslim_cad.checks import Check
from gelslim_cad.dimensions import derive
from gelslim_cad.printability.limits import LIMITS, print_limits
from gelslim_cad.printability.measures import PrintMeasures
from gelslim_cad.printability.rules import TESTS_WALLS, PrintedPart, hint, print_checks
from gelslim_cad.spec import Spec
from gelslim_cad.spec.reader import read_spec
from gelslim_core.yaml.errors import InputError

DESIGN = Path(__file__).parents[2] / "designs" / "mini20.yaml"
GOOD = PrintMeasures(
    size_mm=(50.0, 40.0, 20.0), wall_mm=1.5, wall_at_mm=(0.0, 0.0, 0.0), hole_mm=2.2,
    overhang_mm2=0.0, bridge_mm=5.0, bridge_at_mm=(0.0, 0.0, 5.0), on_part_mm2=0.0, floating=0,
    plate_mm2=900.0, sharp_mm=180.0, openings=0,
)  # fmt: skip


def rules(process: str, *changes: dict[str, Any], name: str = "body") -> dict[str, Check]:
    parts = [PrintedPart("other", GOOD, LIMITS[process])]
    parts += [PrintedPart(name, replace(GOOD, **c), LIMITS[process]) for c in changes]
    return {c.id: c for c in print_checks(tuple(parts))}


@pytest.mark.parametrize("process", LIMITS)
def test_a_good_part_passes_in_every_process(process: str) -> None:
    found = rules(process, {})
    named = ("wall_mm", "hole_mm", "span_mm", "first_layer_mm", "size_mm")
    assert set(found) == {f"print.{name}" for name in named}
    assert {c.status for c in found.values()} == {"pass"}
    assert all(c.margin is None or c.margin >= 0 for c in found.values())
    assert print_checks(()) == ()


@pytest.mark.parametrize(
    ("process", "rule", "change", "status"),
    [
        ("fdm", "print.wall_mm", {"wall_mm": 0.79}, "warn"),
        ("fdm", "print.wall_mm", {"wall_mm": 0.39}, "fail"),
        ("sla", "print.wall_mm", {"wall_mm": 0.79}, "pass"),
        ("sla", "print.wall_mm", {"wall_mm": 0.19}, "fail"),
        ("sls", "print.wall_mm", {"wall_mm": 0.6}, "warn"),
        ("sls", "print.wall_mm", {"wall_mm": None}, "pass"),
        ("fdm", "print.hole_mm", {"hole_mm": 1.4}, "warn"),
        ("fdm", "print.hole_mm", {"hole_mm": 0.4}, "fail"),
        ("sla", "print.hole_mm", {"hole_mm": None}, "pass"),
        ("fdm", "print.span_mm", {"bridge_mm": 12.0, "overhang_mm2": 30.0}, "warn"),
        ("sla", "print.span_mm", {"floating": 1}, "warn"),
        ("sls", "print.span_mm", {"bridge_mm": 500.0}, "pass"),
        ("sla", "print.size_mm", {"size_mm": (146.0, 40.0, 20.0)}, "fail"),
        ("fdm", "print.size_mm", {"size_mm": (205.0, 245.0, 20.0)}, "pass"),
        ("fdm", "print.size_mm", {"size_mm": (20.0, 20.0, 215.0)}, "fail"),
    ],
)
def test_each_rule_has_its_limits(
    process: str, rule: str, change: dict[str, Any], status: str
) -> None:
    found = rules(process, change)[rule]
    assert found.status == status
    if status != "pass":
        assert "body" in found.reason
        assert "other" not in found.reason
        assert found.advice
    if status == "fail":
        assert found.margin is not None
        assert found.margin < 0


@pytest.mark.parametrize(
    ("process", "gap", "sharp", "value", "status"),
    [
        ("fdm", 0.2, 180.0, 0.2, "pass"),
        ("fdm", 0.19, 180.0, 0.2, "warn"),
        ("fdm", 0.1, 0.0, 0.0, "pass"),
        ("sla", 0.1, 180.0, 0.15, "warn"),
        ("sls", 0.02, 180.0, 0.0, "pass"),
    ],
)
def test_the_first_layer_must_fit_the_gap(
    process: str, gap: float, sharp: float, value: float, status: str
) -> None:
    """A part with a chamfer on the plate has no elephant foot."""
    limits = replace(LIMITS[process], gap_mm=gap)
    part = PrintedPart("body", replace(GOOD, sharp_mm=sharp), limits)
    (found,) = (c for c in print_checks((part,)) if c.id == "print.first_layer_mm")
    assert (found.status, found.value, found.limit) == (status, pytest.approx(value), gap)
    assert found.margin == pytest.approx(gap - value)
    assert ("body" in found.reason) is (status == "warn")


def test_the_part_that_tests_walls_may_have_thin_ones() -> None:
    assert rules("fdm", {"wall_mm": 0.2}, name=TESTS_WALLS)["print.wall_mm"].status == "pass"


def test_the_printer_is_told_of_supports_and_openings() -> None:
    def told(process: str, **changes: Any) -> str:
        return hint(PrintedPart("body", replace(GOOD, **changes), LIMITS[process]))

    assert told("sla") == ""
    assert "plate only" in told("sla", overhang_mm2=50.0)
    assert "on the part" in told("fdm", overhang_mm2=50.0, on_part_mm2=20.0)
    assert "3 openings" in told("fdm", openings=3)
    assert told("sls", openings=3, overhang_mm2=50.0) == ""


def spec(**fields: Any) -> Spec:
    loaded = read_spec(DESIGN).spec
    return loaded.model_copy(
        update={"manufacturing": loaded.manufacturing.model_copy(update=fields)}
    )


def test_fields_of_the_spec_replace_the_limits() -> None:
    plain = derive(spec())
    for process, limits in LIMITS.items():
        assert print_limits(plain, process) == limits
    d = derive(
        spec(
            nozzle_mm=0.25,
            max_overhang_deg=50.0,
            max_bridge_mm=7.0,
            elephant_foot_mm=0.05,
            printer_mm=(100.0, 90.0, 80.0),
        )
    )
    fdm = print_limits(d, "fdm")
    assert (fdm.wall_mm, fdm.least_wall_mm) == (0.5, 0.25)
    assert (fdm.overhang_deg, fdm.bridge_mm, fdm.printer_mm) == (50.0, 7.0, (100.0, 90.0, 80.0))
    assert fdm.foot_mm == 0.05
    assert print_limits(d, "sls").wall_mm == LIMITS["sls"].wall_mm
    assert math.isinf(print_limits(plain, "sls").bridge_mm)


def test_a_printer_has_three_sides(tmp_path: Path) -> None:
    path = tmp_path / "spec.yaml"
    path.write_text(
        DESIGN.read_text("utf-8") + "manufacturing:\n  printer_mm: [100, 100]\n", "utf-8"
    )
    with pytest.raises(InputError) as caught:
        read_spec(path)
    (problem,) = caught.value.problems
    assert problem.field == "manufacturing.printer_mm"
    assert problem.line is not None
