"""Rules on the measures of the printed parts: what fails, what warns, and hints to the printer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from gelslim_cad.checks.rule import GROUPS, Check
from gelslim_cad.printability.limits import PrintLimits
from gelslim_cad.printability.measures import PrintMeasures

GROUP = GROUPS["making"]
PROCESS = "manufacturing.print_process"
TESTS_WALLS = "fit_coupon"
"""The part whose thin walls show what the printer can make."""
SAME_MM = 1e-9


@dataclass(frozen=True)
class PrintedPart:
    """A part with its measures and the limits of its process."""

    name: str
    measures: PrintMeasures
    limits: PrintLimits


def print_checks(parts: tuple[PrintedPart, ...]) -> tuple[Check, ...]:
    """Rules on all printed parts together; each shows the part with the least margin."""
    if not parts:
        return ()
    return _walls(parts), _holes(parts), _spans(parts), _first_layers(parts), _sizes(parts)


def _walls(parts: tuple[PrintedPart, ...]) -> Check:
    found = {
        p.name: (p.measures.wall_mm, p.limits.wall_mm, p.limits.least_wall_mm)
        for p in parts
        if p.measures.wall_mm is not None and p.name != TESTS_WALLS
    }
    return _least(
        "print.wall_mm",
        "Walls of the printed parts",
        found,
        "thinner walls get weak or wavy; below half of it they are not printed",
        "use thicker walls, or a finer process",
        "design.housing.side_wall_mm",
    )


def _holes(parts: tuple[PrintedPart, ...]) -> Check:
    found = {
        p.name: (p.measures.hole_mm, p.limits.hole_mm, p.limits.least_hole_mm)
        for p in parts
        if p.measures.hole_mm is not None
    }
    return _least(
        "print.hole_mm",
        "Holes of the printed parts",
        found,
        "narrower holes close in part: drill them out",
        "drill them out, or use a finer process",
        PROCESS,
    )


def _least(
    rule: str,
    title: str,
    found: Mapping[str, tuple[float | None, float, float]],
    why: str,
    advice: str,
    parameter: str,
) -> Check:
    """A rule on a least size; found has value, advised and least size of each part."""
    sizes = {n: (v, advised, hard) for n, (v, advised, hard) in found.items() if v is not None}
    below = [name for name, (value, advised, _) in sizes.items() if value < advised]
    failed = any(value < hard for value, _, hard in sizes.values())
    status: Literal["pass", "warn", "fail"] = "fail" if failed else "warn" if below else "pass"
    worst = min(sizes, key=lambda n: sizes[n][0] - sizes[n][1], default="")
    value, advised, hard = sizes.get(worst, (0.0, 0.0, 0.0))
    limit = hard if failed else advised
    named = ", ".join(f"{n} {sizes[n][0]:.2f} mm" for n in below)
    return Check(
        id=rule,
        title=title,
        value=value,
        limit=limit,
        unit="mm",
        margin=value - limit,
        status=status,
        reason=f"{named}: {why}" if below else "measured on the parts",
        parameter=parameter,
        advice=advice if below else "",
        sense="min",
        group=GROUP,
    )


def _spans(parts: tuple[PrintedPart, ...]) -> Check:
    """Warns only, as supports make any span."""
    wide = [p for p in parts if p.measures.overhang_mm2 > 0 or p.measures.floating]
    worst = max(parts, key=lambda p: p.measures.bridge_mm - p.limits.bridge_mm)
    limit = worst.limits.bridge_mm
    bounded = limit if limit < float("inf") else None
    named = ", ".join(f"{p.name} {p.measures.overhang_mm2:.0f} mm²" for p in wide)
    return Check(
        id="print.span_mm",
        title="Overhangs of the printed parts carry themselves",
        value=worst.measures.bridge_mm,
        limit=bounded,
        unit="mm",
        margin=None if bounded is None else limit - worst.measures.bridge_mm,
        status="warn" if wide else "pass",
        reason=f"{named}: faces that lean out farther than {worst.limits.overhang_deg:g}° and span "
        "more than the limit sag or need supports"
        if wide
        else "measured on the parts",
        parameter=PROCESS,
        advice="print with supports under these faces, or by sls" if wide else "",
        sense="max",
        group=GROUP,
    )


def _first_layers(parts: tuple[PrintedPart, ...]) -> Check:
    """Warns only, as slicers compensate it and a file takes it off."""

    def room(p: PrintedPart) -> float:
        return p.limits.gap_mm - (p.limits.foot_mm if p.measures.sharp_mm > 0 else 0.0)

    tight = [p.name for p in parts if room(p) < -SAME_MM]
    worst = min(parts, key=room)
    gap = worst.limits.gap_mm
    return Check(
        id="print.first_layer_mm",
        title="The first layer stands out by less than the gap of the fits",
        value=gap - room(worst),
        limit=gap,
        unit="mm",
        margin=room(worst),
        status="warn" if tight else "pass",
        reason=f"{', '.join(tight)}: the first layer stands out along sharp edges on the plate "
        "(elephant foot); openings there are too narrow, and tongues too wide"
        if tight
        else "sharp edges on the plate; a chamfer there would have none",
        parameter="manufacturing.elephant_foot_mm",
        advice="compensate it in the slicer and give what is left, or file it off" if tight else "",
        sense="max",
        group=GROUP,
    )


def _sizes(parts: tuple[PrintedPart, ...]) -> Check:
    def excess(p: PrintedPart) -> float:
        room, size = p.limits.printer_mm, p.measures.size_mm
        flat = zip(sorted(size[:2]), sorted(room[:2]), strict=True)
        return max(*(s - r for s, r in flat), size[2] - room[2])

    worst = max(parts, key=excess)
    over = excess(worst)
    too_large = [p.name for p in parts if excess(p) > 0]
    return Check(
        id="print.size_mm",
        title="Room that the printed parts leave in the printer",
        value=-over,
        limit=0.0,
        unit="mm",
        margin=-over,
        status="fail" if too_large else "pass",
        reason=f"{', '.join(too_large)}: larger than {_room(worst)} mm"
        if too_large
        else f"{worst.name} comes nearest to the room of {_room(worst)} mm",
        parameter="manufacturing.printer_mm",
        advice="give the room of your printer, or use a larger one" if too_large else "",
        sense="min",
        group=GROUP,
    )


def _room(part: PrintedPart) -> str:
    return " x ".join(f"{s:g}" for s in part.limits.printer_mm)


def hint(part: PrintedPart) -> str:
    """What the printing service should mind of a part; empty where nothing."""
    m, said = part.measures, []
    if m.overhang_mm2 > 0 and part.limits.process != "sls":
        where = "; some stand on the part" if m.on_part_mm2 > 0 else ", from the plate only"
        said.append(f"supports under {m.overhang_mm2:.0f} mm2 of overhangs{where}")
    if m.openings and part.limits.process != "sls":
        said.append(
            f"{m.openings} openings begin at the plate: compensate the elephant foot, about "
            f"{part.limits.foot_mm:g} mm"
        )
    return "; ".join(said)
