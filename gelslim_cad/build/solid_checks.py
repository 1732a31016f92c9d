"""Design rules that only the solids can answer: free view and no interference."""

from __future__ import annotations

from collections.abc import Sequence

from gelslim_cad.checks import Check
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part

INTERFERENCE_MM3 = 1e-3


def check_solids(d: Dimensions, parts: Sequence[Part]) -> tuple[Check, ...]:
    """Line of sight against the actual solids, and interference between all pairs of parts."""
    from gelslim_cad.proof.interference import interferences
    from gelslim_cad.solids.corridor import blocked_volumes

    blocked = blocked_volumes(d, parts)
    pairs = interferences(parts, tolerance_mm3=INTERFERENCE_MM3)
    return (
        _check(
            "view.line_of_sight",
            "View from gel over mirror to camera is free",
            sum(blocked.values()),
            0.0,
            "in the way: " + ", ".join(f"{n} ({v:.2f} mm³)" for n, v in blocked.items()),
            "design.optics.clearance_mm",
            "give the view more clearance",
        ),
        _check(
            "assembly.interference",
            "No two parts share space",
            sum(p.volume_mm3 for p in pairs),
            INTERFERENCE_MM3,
            "; ".join(f"{p.first} and {p.second} share {p.volume_mm3:.3f} mm³" for p in pairs),
            "design.housing.fit_clearance_mm",
            "give the parts more room",
        ),
    )


def _check(
    rule: str, title: str, value: float, limit: float, problem: str, parameter: str, advice: str
) -> Check:
    good = value <= limit
    return Check(
        id=rule,
        title=title,
        value=value,
        limit=limit,
        unit="mm³",
        margin=limit - value,
        status="pass" if good else "fail",
        reason="measured on the solids" if good else problem,
        parameter=parameter,
        advice="" if good else advice,
    )
