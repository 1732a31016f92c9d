"""Design rules that need the solids: free view, no interference, a mould that can be used."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import partial
from typing import Literal

from gelslim_cad.checks import Check
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.prism import Hole

INTERFERENCE_MM3 = 1e-3
UNDERCUT_MM2 = 1e-3
LEAST_WALL_MM = 3.0
"""Between the cavity and the nearest hole: the wall holds liquid silicone and a clamp's force."""
LEAST_WEB_MM = 0.8
"""Between two openings of the lid: two passes of a common nozzle, more than a laser's kerf."""
LEAST_VENTS = 2


def check_solids(d: Dimensions, parts: Sequence[Part]) -> tuple[Check, ...]:
    """Line of sight past the actual solids, and interference between all pairs of parts."""
    from gelslim_cad.proof.solids import interferences
    from gelslim_cad.solids.corridor import blocked_volumes

    blocked = blocked_volumes(d, parts)
    pairs = interferences(parts, tolerance_mm3=INTERFERENCE_MM3)
    return (
        _check(
            ("view.line_of_sight", "View from gel over mirror to camera is free"),
            (sum(blocked.values()), 0.0, "mm³"),
            "in the way: " + ", ".join(f"{n} ({v:.2f} mm³)" for n, v in blocked.items()),
            ("design.optics.clearance_mm", "give the view more clearance"),
        ),
        _check(
            ("assembly.interference", "No two parts share space"),
            (sum(p.volume_mm3 for p in pairs), INTERFERENCE_MM3, "mm³"),
            "; ".join(f"{p.first} and {p.second} share {p.volume_mm3:.3f} mm³" for p in pairs),
            ("design.housing.fit_clearance_mm", "give the parts more room"),
        ),
    )


def check_mould(d: Dimensions) -> tuple[Check, ...]:
    """Undercut of the cavity, thickness of its walls, webs between the lid's openings, vents."""
    from gelslim_cad.solids.tooling.mould import cavity_in_mould
    from gelslim_cad.solids.tooling.mould_plan import plan_mould
    from gelslim_cad.solids.tooling.undercut import undercut_area_mm2

    plan = plan_mould(d)
    wall_mm = _least_wall_mm(plan.cavity, (*plan.bolts, *plan.dowels))
    web_mm = _least_web_mm((plan.gate, *plan.vents))
    return (
        _mould_check(
            ("mould.undercut_mm2", "Gel comes out of its mould along a straight line"),
            (undercut_area_mm2(cavity_in_mould(d)), UNDERCUT_MM2, "mm²"),
            "the mould overhangs part of the casting",
            ("design.gel.crown_height_mm", "lower the crown"),
            "max",
        ),
        _mould_check(
            ("mould.wall_mm", "Walls of the mould"),
            (wall_mm, LEAST_WALL_MM, "mm"),
            "the wall between cavity and clamp would bend or leak",
            ("design.gel.length_mm", "make the gel larger"),
            "min",
        ),
        _mould_check(
            ("mould.web_mm", "Gate and vents stand apart"),
            (web_mm, LEAST_WEB_MM, "mm"),
            "the lid would break between its openings",
            ("design.gel.width_mm", "make the gel larger"),
            "min",
        ),
        _mould_check(
            ("mould.vents", "Air can leave the mould"),
            (float(len(plan.vents)), float(LEAST_VENTS), ""),
            "trapped air leaves holes in the gel",
            ("design.gel.length_mm", "make the gel larger"),
            "min",
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
    found: tuple[float, float, str],
    problem: str,
    remedy: tuple[str, str],
    sense: Literal["max", "min", ""] = "",
    measured_on: str = "the solids",
    group: str = "",
) -> Check:
    """Compare a value with its limit, which is a least value only where `sense` is "min"."""
    value, limit, unit = found
    margin = value - limit if sense == "min" else limit - value
    good = margin >= 0
    return Check(
        id=rule[0],
        title=rule[1],
        value=value,
        limit=limit,
        unit=unit,
        margin=margin,
        status="pass" if good else "fail",
        reason=f"measured on {measured_on}" if good else problem,
        parameter=remedy[0],
        advice="" if good else remedy[1],
        sense=sense,
        group=group,
    )


_mould_check = partial(
    _check, measured_on="mould and cavity", group="Printing, casting and marking"
)
