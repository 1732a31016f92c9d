"""Design rules on the gel mould: it lets the casting go, its walls stand, its air gets out."""

from __future__ import annotations

import math
from collections.abc import Iterable

from gelslim_cad.checks import Check
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.solids.prism import Hole

UNDERCUT_MM2 = 1e-3
LEAST_WALL_MM = 3.0
"""Between the cavity and the nearest hole or the block's outside: it holds silicone and a clamp."""
LEAST_WEB_MM = 0.8
"""Between two openings of the lid: two passes of a common nozzle, more than a laser's kerf."""
LEAST_VENTS = 2


def check_mould(d: Dimensions) -> tuple[Check, ...]:
    """Undercut of the cavity solid, least wall around it, web between openings, vents."""
    from gelslim_cad.solids.tooling.mould import cavity_in_mould
    from gelslim_cad.solids.tooling.mould_plan import plan_mould
    from gelslim_cad.solids.tooling.undercut import undercut_area_mm2

    plan = plan_mould(d)
    undercut = undercut_area_mm2(cavity_in_mould(d))
    wall = _least_wall_mm(plan.cavity, (*plan.bolts, *plan.dowels))
    openings = (plan.gate, *plan.vents)
    return (
        _check(
            ("mould.undercut_mm2", "Gel comes out of its mould along a straight line"),
            (undercut, UNDERCUT_MM2, "mm²", "max"),
            "skin of the casting has mould above it",
            ("design.gel.crown_height_mm", "lower the crown"),
        ),
        _check(
            ("mould.wall_mm", "Walls of the mould"),
            (wall, LEAST_WALL_MM, "mm", "min"),
            "the wall between cavity and clamp would bend or leak",
            ("design.gel.length_mm", "make the gel larger"),
        ),
        _check(
            ("mould.web_mm", "Gate and vents stand apart"),
            (_least_web_mm(openings), LEAST_WEB_MM, "mm", "min"),
            "the lid would break between its openings",
            ("design.gel.width_mm", "make the gel larger"),
        ),
        _check(
            ("mould.vents", "Air can leave the mould"),
            (float(len(plan.vents)), float(LEAST_VENTS), "", "min"),
            "trapped air leaves holes in the gel",
            ("design.gel.length_mm", "make the gel larger"),
        ),
    )


def _least_wall_mm(cavity: GelShape, holes: Iterable[Hole]) -> float:
    return min(_outside_mm(cavity, x, y) - diameter / 2 for x, y, diameter in holes)


def _outside_mm(shape: GelShape, x: float, y: float) -> float:
    """Distance of a point from the rounded rectangle, negative within."""
    r = shape.corner_radius_mm
    dx, dy = abs(x) - (shape.length_mm / 2 - r), abs(y) - (shape.width_mm / 2 - r)
    return math.hypot(max(dx, 0.0), max(dy, 0.0)) + min(max(dx, dy), 0.0) - r


def _least_web_mm(openings: tuple[Hole, ...]) -> float:
    return min(
        math.hypot(a[0] - b[0], a[1] - b[1]) - (a[2] + b[2]) / 2
        for i, a in enumerate(openings)
        for b in openings[:i]
    )


def _check(
    rule: tuple[str, str],
    found: tuple[float, float, str, str],
    problem: str,
    remedy: tuple[str, str],
) -> Check:
    value, limit, unit, sense = found
    margin = limit - value if sense == "max" else value - limit
    good = margin >= 0
    return Check(
        id=rule[0],
        title=rule[1],
        value=value,
        limit=limit,
        unit=unit,
        margin=margin,
        status="pass" if good else "fail",
        reason="measured on mould and cavity" if good else problem,
        parameter=remedy[0],
        advice="" if good else remedy[1],
        sense="max" if sense == "max" else "min",
        group="Printing, casting and marking",
    )
