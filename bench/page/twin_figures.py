"""Figures of the twin's ladders: error on one axis, time on the other."""

from __future__ import annotations

import math
from typing import Any

Rows = list[dict[str, Any]]
FRICTIONLESS, FRICTIONAL, CHOSEN, FRONT = "#1f4e8c", "#c4580a", "#2d8a57", "#555555"
FLOOR = 1e-3
"""Where errors of nothing are drawn, as a share of the tolerance."""
COLUMNS = 4
DECADE = 3.0
"""From this range of times on their axis is logarithmic."""


def draw_scenes(drops: Rows) -> bytes:
    """A panel per scene: effects dropped one by one, the front, the planner's choice."""
    from gelslim_core.figure import as_png, new_figure

    names = list(dict.fromkeys(r["scene"] for r in drops))
    rows = -(-len(names) // COLUMNS)
    figure, axes = new_figure(16.0, 3.7 * rows, columns=COLUMNS, rows=rows)
    panels = list(axes.flat)
    for panel, name in zip(panels, names, strict=False):
        draw_scene(panel, name, [r for r in drops if r["scene"] == name])
    for panel in panels[len(names) :]:
        panel.set_visible(False)
    for panel in panels[::COLUMNS][:rows]:
        panel.set_ylabel("error over tolerance")
    marks, texts = panels[0].get_legend_handles_labels()
    figure.legend(marks, texts, fontsize=9, frameon=False, loc="outside lower center", ncols=3)
    return as_png(figure)


def draw_scene(panel: Any, name: str, rows: Rows) -> None:
    """One scene."""
    steps = [r for r in rows if r["label"] != "auto"]
    (auto,) = (r for r in rows if r["label"] == "auto")
    best = sorted((r for r in rows if r["front"]), key=lambda r: r["ms"])
    panel.plot(
        [r["ms"] for r in best], [shown(r) for r in best], color=FRONT, lw=1, label="front",
        drawstyle="steps-post",
    )  # fmt: skip
    panel.scatter(
        [r["ms"] for r in steps], [shown(r) for r in steps], s=16, color=FRICTIONLESS,
        label="one effect less each", zorder=3,
    )  # fmt: skip
    panel.scatter(
        auto["ms"], shown(auto), s=110, facecolors="none", edgecolors=CHOSEN, lw=2,
        label="planner's choice", zorder=4,
    )  # fmt: skip
    names = [f"{k}  {row['label'].replace('_', ' ')}" for k, row in enumerate(steps)]
    panel.text(
        0.03, 0.04, "\n".join(names), transform=panel.transAxes, fontsize=7, ha="left", va="bottom",
        zorder=5, bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5},
    )  # fmt: skip
    panel.axhline(1.0, color="#c03060", lw=1, ls="--")
    panel.set_xscale("log")
    panel.xaxis.set_minor_formatter("")
    panel.set_yscale("log")
    panel.set_ylim(FLOOR / 2, 1e4)
    times = [r["ms"] for r in rows]
    panel.set_xlim(min(times) / 1.6, max(times) * 2)
    number(panel, steps)
    panel.set_xlabel("ms per pose and frame", fontsize=8)
    panel.set_title(name, fontsize=10)
    panel.grid(alpha=0.3)


def number(panel: Any, steps: Rows) -> None:
    """Numbers beside the points, one label for points that lie together, as 2-5."""
    near = (0.035 * math.log(panel.get_xlim()[1] / panel.get_xlim()[0]), 0.7)
    groups: list[list[int]] = []
    for k, row in enumerate(steps):
        for group in groups:
            other = steps[group[-1]]
            apart = abs(math.log(row["ms"] / other["ms"])), abs(math.log(shown(row) / shown(other)))
            if group[-1] == k - 1 and apart[0] < near[0] and apart[1] < near[1]:
                group.append(k)
                break
        else:
            groups.append([k])
    for group in groups:
        row = min((steps[k] for k in group), key=lambda r: r["ms"])
        text = str(group[0]) if len(group) == 1 else f"{group[0]}-{group[-1]}"
        panel.annotate(
            text, (row["ms"], shown(row)), fontsize=7, xytext=(-3, 5), textcoords="offset points"
        )


def shown(row: dict[str, Any]) -> float:
    """Error over tolerance; none is drawn at the lower edge."""
    return max(FLOOR, float(row["of_tolerance"]))


def draw_contact(data: dict[str, Any]) -> bytes:
    """Three panels: tolerance, load steps, layers."""
    from gelslim_core.figure import as_png, new_figure

    figure, axes = new_figure(15.0, 4.6, columns=3)
    ladder(axes[0], data["contact"], "tolerance", "auto", "planner's choice")
    ladder(axes[1], data["steps"], "steps", "", "")
    axes[0].set_title("solver tolerance, against 1e-9", fontsize=11)
    axes[1].set_title("load steps per movement, against many, last pose", fontsize=11)
    axes[0].set_xlabel("ms per pose")
    axes[1].set_xlabel("ms for the whole path")
    axes[0].set_ylabel("error of the force field (relative L2)")
    if "layers" not in data:
        axes[2].set_visible(False)
        return as_png(figure)
    ladder(axes[2], data["layers"], "layers", "design", "the design's")
    axes[2].set_title(f"mesh layers, against {data['layers'][0]['against']}", fontsize=11)
    axes[2].set_xlabel("seconds of set-up, once per pad")
    return as_png(figure)


def ladder(panel: Any, rows: Rows, knob: str, mark: str, meaning: str) -> None:
    """One ladder with and without friction; time is set-up's for layers, solving's else."""
    key = "setup_s" if knob == "layers" else "ms"
    for friction, colour in ((0.0, FRICTIONLESS), (0.6, FRICTIONAL)):
        able = [r for r in rows if r["friction"] == friction and "failed" not in r]
        # Without friction the path does not matter: what is left is rounding.
        errors = [max(1e-8, r["field_error"]) for r in able]
        label = f"μ {friction:g}" if friction else "frictionless"
        panel.scatter([r[key] for r in able], errors, color=colour, s=18, label=label, zorder=3)
        best = sorted(front_of([(r[key], e) for r, e in zip(able, errors, strict=True)]))
        panel.plot([t for t, _ in best], [e for _, e in best], color=colour, lw=1, alpha=0.7)
        for row, error, text in zip(able, errors, knob_labels(able, knob), strict=True):
            place = (row[key], error)
            panel.annotate(
                text, place, fontsize=7, color=colour, ha="left" if friction else "right",
                xytext=(4, 4) if friction else (-4, -9), textcoords="offset points",
            )  # fmt: skip
            if mark and row[mark]:
                panel.scatter(*place, s=120, facecolors="none", edgecolors=CHOSEN, lw=2, zorder=4)
    if mark:
        panel.scatter([], [], s=80, facecolors="none", edgecolors=CHOSEN, lw=2, label=meaning)
    panel.plot([], [], color=FRONT, lw=1, label="front")
    times = [r[key] for r in rows if "failed" not in r]
    if max(times) > DECADE * min(times):
        panel.set_xscale("log")
        panel.xaxis.set_minor_formatter("")
        panel.xaxis.set_major_formatter("{x:g}")
    panel.margins(x=0.18)
    panel.set_yscale("log")
    panel.grid(alpha=0.3)
    panel.legend(fontsize=8, frameon=False)


def knob_labels(rows: Rows, knob: str) -> list[str]:
    """A label per row; rows after each other with one error have one, at the first."""
    runs: list[list[float]] = []
    for k, row in enumerate(rows):
        same = k > 0 and abs(row["field_error"] / rows[k - 1]["field_error"] - 1) < 0.05
        if same and row["field_error"] > 0 and knob == "tolerance":
            runs[-1].append(row[knob])
        else:
            runs.append([row[knob]])
    found = []
    for run in runs:
        text = f"{run[0]:g}" if len(run) == 1 else f"{run[0]:g} to {run[-1]:g}"
        found += [text, *[""] * (len(run) - 1)]
    return found


def front_of(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Points (time, error) that no other one beats in both."""
    return [
        p for p in points
        if not any(o[0] <= p[0] and o[1] <= p[1] and o != p for o in points)
    ]  # fmt: skip
