"""Sentences and tables of docs/accuracy_vs_time.md, from the ladders alone."""

from __future__ import annotations

from collections.abc import Sequence

from bench.page.ladder_record import LadderRecord, RungRecord

MOST_ROWS = 9
SEEN_PX = 0.05
"""Smallest shift that a good detector can see."""
ALIKE = 1.05
"""Errors or times within this factor count as the same."""


def error_text(ladder: LadderRecord, error: float) -> str:
    """Return an error with its unit."""
    if ladder.error_unit in ("relative", "share"):
        return f"{100 * error:.3g} %" if error >= 1e-7 or error == 0 else f"{error:.1e}"
    unit = {"um": "µm"}.get(ladder.error_unit, ladder.error_unit)
    if ladder.error_unit == "mm":
        return f"{1000 * error:.3g} µm" if error >= 1e-9 else f"{1000 * error:.0e} µm"
    return f"{error:.3g} {unit}" if error >= 1e-3 or error == 0 else f"{error:.1e} {unit}"


def time_text(ladder: LadderRecord, time: float) -> str:
    """Return a time with its unit, in milliseconds if it is short."""
    if ladder.time_unit == "s" and time < 0.1:
        return f"{1000 * time:.3g} ms"
    if ladder.time_unit == "ms" and time >= 1000:
        return f"{time / 1000:.3g} s"
    return f"{time:.3g} {ladder.time_unit}"


def span(texts: Sequence[str]) -> str:
    """Return the first and the last of some values as text, or one if they agree."""
    return texts[0] if texts[0] == texts[-1] else f"{texts[0]} to {texts[-1]}"


def spoken(ladder: LadderRecord, rungs: Sequence[RungRecord]) -> str:
    """Return error and time of some rungs for a table."""
    errors = sorted(r.error for r in rungs)
    times = sorted(r.time for r in rungs)
    low, high = (error_text(ladder, e) for e in (errors[0], errors[-1]))
    fast, slow = (time_text(ladder, t) for t in (times[0], times[-1]))
    return f"{span((low, high))} in {span((fast, slow))}"


def times(factor: float) -> str:
    """Return a factor of 1 or more as text."""
    return f"{factor:.2g} times" if factor < 99.5 else f"{float(f'{factor:.2g}'):,.0f} times"


def stated(ladder: LadderRecord, rungs: Sequence[RungRecord]) -> str:
    """Return error and time of some rungs as the end of a sentence."""
    error, _, time = spoken(ladder, rungs).partition(" in ")
    return f"has an error of {error} and takes {time}"


def conclusion(ladder: LadderRecord) -> str:
    """Return what the figure shows, in a few sentences."""
    if ladder.kind == "omissions":
        return _omitted(ladder)
    if not ladder.ours:
        quick, good = ladder.fronts[0][0], ladder.fronts[0][-1]
        return (
            f"The fastest rung of the front, {quick.label}, {stated(ladder, [quick])}. The most "
            f"accurate one, {good.label}, {stated(ladder, [good])}."
        )
    name = f" ({ladder.ours[0].label})" if len(ladder.ours) == 1 else ""
    parts = [f"Our default{name} {stated(ladder, ladder.ours)}."]
    if ladder.papers:
        parts.append(f"The paper's choice {stated(ladder, ladder.papers)}.")
    return " ".join([*parts, _beaten(ladder)])


def beating(ladder: LadderRecord, ours: RungRecord) -> list[RungRecord]:
    """Return the rungs that are no worse in both and clearly better in one."""
    return [
        r
        for r in ladder.rivals(ours)
        if r.beats(ours) and (r.error * ALIKE < ours.error or r.time * ALIKE < ours.time)
    ]


def _beaten(ladder: LadderRecord) -> str:
    """Return whether a rung beats our choice, and what more accuracy would cost."""
    better = [
        (ours, min(beating(ladder, ours), key=lambda r: r.error))
        for ours in ladder.ours
        if beating(ladder, ours)
    ]
    if better:
        cases = "; ".join(dict.fromkeys(f"{b.label} ({spoken(ladder, [b])})" for _, b in better))
        part = f" in {len(better)} of {len(ladder.ours)} problems" if len(ladder.ours) > 1 else ""
        return f"**It is beaten in both error and time**{part} by {cases}."
    if len(ladder.ours) > 1:
        return "No other measured rung is better in both error and time."
    (ours,) = ladder.ours
    finer = [r for r in ladder.fronts[0] if r.error < ours.error / ALIKE]
    if not finer or ours.error == 0:
        return "No other rung of its front is more accurate."
    nxt, best = finer[0], finer[-1]
    text = (
        f"The next more accurate rung, {nxt.label}, takes {times(nxt.time / ours.time)} the time "
        f"and has an error of {error_text(ladder, nxt.error)}."
    )
    if best is nxt:
        return text
    return (
        f"{text} The most accurate one, {best.label}, takes {times(best.time / ours.time)} the "
        f"time and has an error of {error_text(ladder, best.error)}."
    )


def _omitted(ladder: LadderRecord) -> str:
    seen = [r for r in ladder.rungs if r.error >= SEEN_PX]
    dear = max(ladder.rungs, key=lambda r: r.time)
    most = max(ladder.rungs, key=lambda r: r.error)
    quiet = [r.series for r in ladder.rungs if r.error < SEEN_PX]
    text = (
        f"{len(seen)} of {len(ladder.rungs)} effects move markers by {SEEN_PX:g} px or more if "
        f"they are left out. {most.series} moves them most ({error_text(ladder, most.error)}). "
        f"{dear.series} takes the most time ({time_text(ladder, dear.time)}, "
        f"{error_text(ladder, dear.error)})."
    )
    return text + (f" Below {SEEN_PX:g} px are: {', '.join(quiet)}." if quiet else "")


def table(ladder: LadderRecord) -> str:
    """Return the rungs by time: all if they are few, else the front, the paper's and ours."""
    rungs = list(ladder.rungs)
    if len(rungs) > MOST_ROWS and ladder.kind != "omissions":
        rungs = _thinned(ladder)
    order = list(ladder.series)
    by_problem = ladder.kind == "problems"
    rungs.sort(key=lambda r: (order.index(r.series) if by_problem else 0, r.time, r.error))
    heads = ["", "error", "time"] + ([ladder.count_label] if ladder.count_label else []) + [""]
    if ladder.kind == "omissions":
        heads[1:3] = ["shift without it", "time it costs"]
    lines = ["| " + " | ".join(heads) + " |", "|---" + "|---:" * (len(heads) - 2) + "|---|"]
    for r in rungs:
        cells = [r.label, error_text(ladder, r.error), time_text(ladder, r.time)]
        if ladder.count_label:
            cells.append("" if r.count is None else count_text(r.count))
        lines.append("| " + " | ".join([*cells, marks(ladder, r)]) + " |")
    return "\n".join(lines)


def count_text(count: float) -> str:
    """Return a count or another figure as text."""
    return f"{count:,.0f}" if count >= 1000 and count == int(count) else f"{count:.3g}"


def _thinned(ladder: LadderRecord) -> list[RungRecord]:
    """Return ours, the paper's, and the front, thinned evenly if it is long."""
    chosen = [r for r in ladder.rungs if r.is_ours or r.is_paper]
    if ladder.kind != "ladder":
        some = {ladder.series[k] for k in (0, len(ladder.series) // 2, -1)}
        front = [r for f in ladder.fronts for r in f]
        return [r for r in ladder.rungs if r.series in some and (r in chosen or r in front)]
    front = [r for r in ladder.fronts[0] if r not in chosen]
    room = max(2, MOST_ROWS - len(chosen))
    if len(front) > room:
        front = [front[round(k * (len(front) - 1) / (room - 1))] for k in range(room)]
    return [*chosen, *front]


def marks(ladder: LadderRecord, rung: RungRecord) -> str:
    """Return whether a rung is ours, the paper's, on the front."""
    on_front = any(rung in f for f in ladder.fronts)
    flags = ((rung.is_ours, "**ours**"), (rung.is_paper, "paper"), (on_front, "front"))
    return ", ".join(text for is_so, text in flags if is_so)


def overview(ladder: LadderRecord, link: str) -> str:
    """Return the row of a ladder in the table at the top of the page."""
    ours = spoken(ladder, ladder.ours) if ladder.ours else ""
    papers = spoken(ladder, ladder.papers) if ladder.papers else ""
    verdict = ""
    if ladder.ours:
        beaten = sum(bool(beating(ladder, o)) for o in ladder.ours)
        part = f" in {beaten} of {len(ladder.ours)}" if len(ladder.ours) > 1 else ""
        verdict = f"beaten{part}" if beaten else "on the front"
    return f"| {link} | {ours} | {papers} | {verdict} |"
