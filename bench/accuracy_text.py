"""Sentences and tables of the page, from ladders alone."""

from __future__ import annotations

from collections.abc import Sequence

from ladder_record import LadderRecord, RungRecord

MOST_ROWS = 9
SEEN_PX = 0.05
"""What a good detector tells apart."""
ALIKE = 1.05
"""Errors or times within this factor are called the same."""


def error_text(ladder: LadderRecord, error: float) -> str:
    """An error with its unit."""
    if ladder.error_unit in ("relative", "share"):
        return f"{100 * error:.3g} %" if error >= 1e-7 or error == 0 else f"{error:.1e}"
    unit = {"um": "µm"}.get(ladder.error_unit, ladder.error_unit)
    if ladder.error_unit == "mm":
        return f"{1000 * error:.3g} µm" if error >= 1e-9 else f"{1000 * error:.0e} µm"
    return f"{error:.3g} {unit}" if error >= 1e-3 or error == 0 else f"{error:.1e} {unit}"


def time_text(ladder: LadderRecord, time: float) -> str:
    """A time with its unit; milliseconds for what is short."""
    if ladder.time_unit == "s" and time < 0.1:
        return f"{1000 * time:.3g} ms"
    if ladder.time_unit == "ms" and time >= 1000:
        return f"{time / 1000:.3g} s"
    return f"{time:.3g} {ladder.time_unit}"


def span(texts: Sequence[str]) -> str:
    """Least and largest of some values as text, or the one."""
    return texts[0] if texts[0] == texts[-1] else f"{texts[0]} to {texts[-1]}"


def spoken(ladder: LadderRecord, rungs: Sequence[RungRecord]) -> str:
    """Error and time of some rungs."""
    errors = sorted(r.error for r in rungs)
    times = sorted(r.time for r in rungs)
    low, high = (error_text(ladder, e) for e in (errors[0], errors[-1]))
    fast, slow = (time_text(ladder, t) for t in (times[0], times[-1]))
    return f"{span((low, high))} in {span((fast, slow))}"


def times(factor: float) -> str:
    """A factor in words, 1 and more."""
    return f"{factor:.2g} times" if factor < 99.5 else f"{float(f'{factor:.2g}'):,.0f} times"


def conclusion(ladder: LadderRecord) -> str:
    """What the figure says, in a sentence or two."""
    if ladder.kind == "omissions":
        return _omitted(ladder)
    if not ladder.ours:
        quick, good = ladder.fronts[0][0], ladder.fronts[0][-1]
        return (
            f"The front goes from {quick.label} ({spoken(ladder, [quick])}) to {good.label} "
            f"({spoken(ladder, [good])})."
        )
    name = f" ({ladder.ours[0].label})" if len(ladder.ours) == 1 else ""
    text = f"Our default{name} errs {spoken(ladder, ladder.ours)}"
    if ladder.papers:
        text += f", the paper's choice {spoken(ladder, ladder.papers)}"
    return f"{text}{_beaten(ladder)}."


def beating(ladder: LadderRecord, ours: RungRecord) -> list[RungRecord]:
    """Rungs that are no worse in error and time and clearly better in one."""
    return [
        r
        for r in ladder.rivals(ours)
        if r.beats(ours) and (r.error * ALIKE < ours.error or r.time * ALIKE < ours.time)
    ]


def _beaten(ladder: LadderRecord) -> str:
    """Whether something measured beats our choice, and what more accuracy would cost."""
    better = [
        (ours, min(beating(ladder, ours), key=lambda r: r.error))
        for ours in ladder.ours
        if beating(ladder, ours)
    ]
    if better:
        cases = "; ".join(dict.fromkeys(f"{b.label} ({spoken(ladder, [b])})" for _, b in better))
        part = f" in {len(better)} of {len(ladder.ours)} problems" if len(ladder.ours) > 1 else ""
        return f"; **it is beaten in both**{part} by {cases}"
    if len(ladder.ours) > 1:
        return "; nothing measured beats it in both"
    (ours,) = ladder.ours
    finer = [r for r in ladder.fronts[0] if r.error < ours.error / ALIKE]
    if not finer or ours.error == 0:
        return "; nothing measured is more accurate"
    nxt, best = finer[0], finer[-1]
    text = f"; the next better rung, {nxt.label}, takes {times(nxt.time / ours.time)} the time for "
    text += error_text(ladder, nxt.error)
    if best is not nxt:
        text += f", the best {times(best.time / ours.time)} for {error_text(ladder, best.error)}"
    return text


def _omitted(ladder: LadderRecord) -> str:
    seen = [r for r in ladder.rungs if r.error >= SEEN_PX]
    dear = max(ladder.rungs, key=lambda r: r.time)
    most = max(ladder.rungs, key=lambda r: r.error)
    quiet = [r.series for r in ladder.rungs if r.error < SEEN_PX]
    text = (
        f"{len(seen)} of {len(ladder.rungs)} effects shift markers by {SEEN_PX:g} px or more when "
        f"left out, {most.series} the most ({error_text(ladder, most.error)}); the dearest is "
        f"{dear.series} ({time_text(ladder, dear.time)}, {error_text(ladder, dear.error)})"
    )
    return text + (f"; below that: {', '.join(quiet)}." if quiet else ".")


def table(ladder: LadderRecord) -> str:
    """Rungs by time: all where they are few, else front, paper's and ours, of three problems."""
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
    """A number of things, or a figure beside error and time."""
    return f"{count:,.0f}" if count >= 1000 and count == int(count) else f"{count:.3g}"


def _thinned(ladder: LadderRecord) -> list[RungRecord]:
    """What matters: ours, the paper's, and the front, evenly thinned where it is long."""
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
    """Ours, the paper's, on the front."""
    on_front = any(rung in f for f in ladder.fronts)
    flags = ((rung.is_ours, "**ours**"), (rung.is_paper, "paper"), (on_front, "front"))
    return ", ".join(text for is_so, text in flags if is_so)


def overview(ladder: LadderRecord, link: str) -> str:
    """One row of the table at the top: ours, the paper's, and whether ours is on the front."""
    ours = spoken(ladder, ladder.ours) if ladder.ours else ""
    papers = spoken(ladder, ladder.papers) if ladder.papers else ""
    verdict = ""
    if ladder.ours:
        beaten = sum(bool(beating(ladder, o)) for o in ladder.ours)
        part = f" in {beaten} of {len(ladder.ours)}" if len(ladder.ours) > 1 else ""
        verdict = f"beaten{part}" if beaten else "on the front"
    return f"| {link} | {ours} | {papers} | {verdict} |"
