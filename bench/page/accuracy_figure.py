"""One figure per ladder, all alike: error up, time across, front, the paper's and our choice."""

from __future__ import annotations

import hashlib
import io
import json
import math
from typing import Any, NamedTuple

from bench.page.ladder_record import LadderRecord, RungRecord

SIZE_IN, DPI = (8.5, 5.4), 110
COLOURS = ("#1f4e8c", "#c4580a", "#2d8a57", "#7a3f8f", "#b59b00", "#30a0b0", "#c03060", "#7f7f7f",
           "#0b1e3d", "#e8a66b", "#5f9bd6", "#86b86b", "#3b3b3b")  # fmt: skip
OURS, PAPER, FRONT = "#d62728", "#000000", "#9aa3ad"
NEGLIGIBLE = 1e-6
"""Of a ladder's largest error: what is below is drawn there, as an open triangle."""
_SIDES = (1, 3), (1, -10), (-1, 3), (-1, -10)
"""Places of a name: to the right or left of its point, and above or below, in points."""
_DOT_PX = 3.0
_NAME_PT, _LETTER = 7.5, 0.52
"""Size of the names, and the usual width of a letter over it."""
MOST_NAMES = {"ladder": 20, "problems": 8, "omissions": 30}
KEY = "Ladder"
"""PNG text that says from which record a figure was drawn."""
UNITS = {"relative": "", "share": "", "um": " (µm)", "px": " (px)", "N": " (N)", "mm": " (mm)",
         "grey values": " (grey values)"}  # fmt: skip


def digest(ladder: LadderRecord) -> str:
    """SHA-256 of what a figure shows."""
    record = {k: v for k, v in ladder.to_record().items() if k != "header"}
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode("utf-8")).hexdigest()


def drawn(ladder: LadderRecord) -> bytes:
    """The figure as PNG; the same record gives the same bytes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=SIZE_IN, dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    _points(axes, ladder)
    _fronts(axes, ladder)
    _choices(axes, ladder)
    _frame(axes, ladder)
    _names(axes, ladder)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=4, fontsize=8, frameon=False,
        markerscale=0.7,
    )  # fmt: skip
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None, KEY: digest(ladder)})
    return stream.getvalue()


def floor(ladder: LadderRecord) -> tuple[float, float]:
    """Where errors and times too small for the axes are drawn."""
    errors = [r.error for r in ladder.rungs if r.error > 0]
    times = [r.time for r in ladder.rungs if r.time > 0]
    least = min((e for e in errors if e > NEGLIGIBLE * max(errors)), default=1.0)
    zero = any(r.error <= NEGLIGIBLE * max(errors, default=0.0) for r in ladder.rungs)
    lowest = least / 3 if zero else least
    return lowest, min(times, default=1.0) / (3 if any(r.time == 0 for r in ladder.rungs) else 1)


def _spot(ladder: LadderRecord, rung: RungRecord) -> tuple[float, float]:
    error, time = floor(ladder)
    return max(rung.time, time), max(rung.error, error)


def _points(axes: Any, ladder: LadderRecord) -> None:
    for k, name in enumerate(ladder.series):
        colour = COLOURS[k % len(COLOURS)]
        rungs = [r for r in ladder.rungs if r.series == name]
        named = ladder.kind != "omissions" and len(ladder.series) > 1
        for shape, some in (("o", True), ("v", False)):
            here = [r for r in rungs if (_spot(ladder, r)[1] == r.error) is some]
            if not here:
                continue
            axes.scatter(
                *zip(*(_spot(ladder, r) for r in here), strict=True),
                s=34,
                marker=shape,
                facecolor=colour if some else "none",
                edgecolor=colour,
                label=name if named and (some or here == rungs) else None,
                zorder=3,
            )
    if any(r.error < floor(ladder)[0] for r in ladder.rungs):
        axes.scatter([], [], s=34, marker="v", facecolor="none", edgecolor="#333a44",
                     label="smaller than the axis shows")  # fmt: skip


def _names(axes: Any, ladder: LadderRecord) -> None:
    """Beside the points, at the first place that lies on no other name or point."""
    point_px = axes.figure.dpi / 72
    left, right = (axes.transData.transform((x, 1.0))[0] for x in axes.get_xlim())
    spots = [axes.transData.transform(_spot(ladder, r)) for r in ladder.rungs]
    taken = [_Box(x - _DOT_PX, y - _DOT_PX, 2 * _DOT_PX, 2 * _DOT_PX) for x, y in spots]
    for rung in sorted(_named(ladder), key=lambda r: _spot(ladder, r)[1], reverse=True):
        (x, y), name = axes.transData.transform(_spot(ladder, rung)), _short(ladder, rung)
        size = _NAME_PT * _LETTER * len(name) * point_px, _NAME_PT * point_px
        boxes = {
            (side, up): _Box(
                x + 7 * side * point_px - (side < 0) * size[0], y + up * point_px, *size
            )
            for side, up in _SIDES
        }
        inside = {k: b for k, b in boxes.items() if b.x > left and b.x + b.width < right}
        free = [k for k, b in inside.items() if not any(b.meets(other) for other in taken)]
        side, up = (free or list(inside) or list(boxes))[0]
        taken.append(boxes[side, up])
        axes.annotate(
            name, _spot(ladder, rung), xytext=(7 * side, up), fontsize=_NAME_PT,
            textcoords="offset points", color="#333a44", ha="right" if side < 0 else "left",
        )  # fmt: skip


class _Box(NamedTuple):
    """A rectangle in pixels, by its lower left corner."""

    x: float
    y: float
    width: float
    height: float

    def meets(self, other: _Box) -> bool:
        """Whether it lies on another one."""
        across = self.x < other.x + other.width and other.x < self.x + self.width
        return across and self.y < other.y + other.height and other.y < self.y + self.height


def _named(ladder: LadderRecord) -> list[RungRecord]:
    """Rungs with their name beside them: all where there is room."""
    return list(ladder.rungs) if len(ladder.rungs) <= MOST_NAMES[ladder.kind] else []


def _short(ladder: LadderRecord, rung: RungRecord) -> str:
    if ladder.kind == "omissions":
        return rung.series
    return rung.label.replace(f", {rung.series}", "") if rung.series else rung.label


def _fronts(axes: Any, ladder: LadderRecord) -> None:
    for k, front in enumerate(ladder.fronts):
        spots = [_spot(ladder, r) for r in front]
        label = None if k else "front: no rung beats these in both"
        axes.plot(*zip(*spots, strict=True), color=FRONT, lw=1.4, zorder=1, label=label)
        axes.scatter(*zip(*spots, strict=True), s=90, marker="o", color=FRONT, alpha=0.45, zorder=1)


def _choices(axes: Any, ladder: LadderRecord) -> None:
    for rungs, colour, marker, size, label in (
        (ladder.papers, PAPER, "*", 210, "the paper's choice"),
        (ladder.ours, OURS, "o", 170, "our default"),
    ):
        if not rungs:
            continue
        spots = list(zip(*(_spot(ladder, r) for r in rungs), strict=True))
        face = PAPER if marker == "*" else "none"
        axes.scatter(
            *spots, s=size, marker=marker, facecolor=face, edgecolor=colour, lw=1.8, label=label,
            zorder=4,
        )  # fmt: skip


def _frame(axes: Any, ladder: LadderRecord) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(f"{ladder.time_label} ({ladder.time_unit})")
    axes.set_ylabel(ladder.error_label + UNITS[ladder.error_unit])
    axes.set_title(ladder.title, fontsize=11, loc="left")
    axes.grid(alpha=0.25, which="major")
    axes.margins(x=0.16, y=0.1)
    # At least a decade, so that what takes the same time is not drawn apart.
    for low, high, put in ((*axes.get_xlim(), axes.set_xlim), (*axes.get_ylim(), axes.set_ylim)):
        if high / low < 10:
            middle = math.sqrt(low * high)
            put(middle / math.sqrt(10), middle * math.sqrt(10))
    _ticks(axes.xaxis, axes.get_xlim(), 1.0, "")
    percent = ladder.error_unit in ("relative", "share")
    _ticks(axes.yaxis, axes.get_ylim(), *((100.0, " %") if percent else (1.0, "")))


def _ticks(axis: Any, limits: tuple[float, float], factor: float, unit: str) -> None:
    """Plain numbers; 2 and 5 besides the decades where there are few."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    subs = (1.0, 2.0, 5.0) if limits[1] / limits[0] < 300 else (1.0,)
    axis.set_major_locator(LogLocator(subs=subs, numticks=20))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{factor * value:g}{unit}"))
    axis.set_minor_formatter(NullFormatter())
