"""Picture of the light tracer's benchmark."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from bench.bench_data import write_whole

INK, GRID = "#333a44", {"alpha": 0.25, "which": "major"}
POINTS = {
    ("sobol", 0.05): ("#1f4e8c", "o", "Sobol, both branches above 5 %"),
    ("sobol", 1.0): ("#5f9bd6", "s", "Sobol, one branch"),
    ("random", 0.05): ("#c4580a", "^", "pseudo-random, both branches above 5 %"),
    ("random", 1.0): ("#e8a66b", "v", "pseudo-random, one branch"),
}
QUANTITIES = {"arrived": ("light on the coat", "-"), "entered_gel": ("light into the gel", "--")}
SETTINGS = {
    "gelslim2, own legs": "#1f4e8c",
    "plain, legs of gelslim2": "#1c7d3a",
    "plain, short legs": "#c4580a",
}


def draw(report: dict[str, Any], path: Path) -> None:
    """Write the picture in one piece."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14.5, 9.0), dpi=130, layout="constrained")
    FigureCanvasAgg(figure)
    rows: Any = figure.subfigures(2, 1, height_ratios=(1.08, 1))
    upper, lower = rows
    errors = upper.subplots(1, 4)
    _errors(errors, report["ladder"])
    handles, labels = errors[0].get_legend_handles_labels()
    upper.legend(handles, labels, loc="outside lower center", ncols=5, frameon=False, fontsize=9)
    left, right = lower.subplots(1, 2)
    _facets(left, report["facets"])
    _ratios(right, report["ratios"], report["earlier"])
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    write_whole(path, stream.getvalue())


def _errors(panels: Any, ladder: dict[str, Any]) -> None:
    delivered, leak = "error_delivered", "error_leaked.outer_bend_right"
    asked = (
        ("rays", delivered, "light on the coat", "rays"),
        ("cpu_s", delivered, "light on the coat", "CPU seconds, one thread"),
        ("rays", leak, "leak of one bend", "rays"),
        ("cpu_s", leak, "leak of one bend", "CPU seconds, one thread"),
    )
    for panel, (across, up, what, label) in zip(panels, asked, strict=True):
        for (sampling, split), (colour, mark, name) in POINTS.items():
            rows = [r for r in ladder["rows"] if (r["sampling"], r["split"]) == (sampling, split)]
            x, y = [r[across] for r in rows], [r[up] for r in rows]
            panel.loglog(x, y, color=colour, marker=mark, ms=5, lw=1.5, label=name)
        floor = ladder["reference"][up.removeprefix("error_")]["relative_error"]
        panel.axhline(floor, color=INK, lw=1.0, ls=":", label="reference's own error")
        panel.axhline(0.01, color=INK, lw=0.8)
        panel.annotate(
            "1 %", (1, 0.01), xycoords=("axes fraction", "data"), xytext=(-4, 3), ha="right",
            textcoords="offset points", fontsize=9,
        )  # fmt: skip
        panel.set_title(f"(a) error of {what}", fontsize=10, loc="left")
        panel.set_xlabel(label)
        panel.set_ylabel("relative error, RMS")
        panel.grid(**GRID)


def _facets(panel: Any, facets: dict[str, Any]) -> None:
    rows = [r for r in facets["rows"] if r["facet_deg"] > 0]
    exact = next(r for r in facets["rows"] if r["facet_deg"] == 0)
    angles = [r["facet_deg"] for r in rows]
    panel.plot(angles, [r["leak"] for r in rows], color="#1f4e8c", marker="o", ms=5, label="chords")
    panel.set_yscale("symlog", linthresh=1e-5, linscale=0.6)
    panel.set_xscale("log")
    panel.axhline(
        exact["leak"], color="#1c7d3a", lw=2.0, label=f"exact arc: {exact['leak']:g}", zorder=1
    )
    limit = 2 * facets["margin_deg"]
    panel.axvspan(limit, 40, color="#c4580a", alpha=0.08, lw=0)
    panel.axvline(limit, color="#c4580a", lw=1.4, label=f"half a chord = margin, {limit / 2:.2f}°")
    panel.set_xlim(0.4, 40)
    panel.set_ylim(-2e-6, 1)
    ticks = [0.5, 1, 2, 5, 10, 20]
    panel.set_xticks(ticks, [f"{tick:g}°" for tick in ticks])
    panel.set_xticks([], minor=True)
    panel.set_yticks(
        [0, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1], ["0", "1e-5", "1e-4", "1e-3", "1 %", "10 %"]
    )
    panel.set_xlabel("angle of a chord of the bend")
    panel.set_ylabel("share of the light that leaks")
    panel.set_title(
        f"(b) a bend that guides NA {facets['na']:g} fully (R/t = {facets['bend_ratio']:.2f}), "
        "cut into chords",
        fontsize=10,
        loc="left",
    )
    panel.legend(frameon=False, fontsize=9, loc="lower right")
    panel.grid(**GRID)


def _ratios(panel: Any, ratios: dict[str, Any], earlier: list[dict[str, Any]]) -> None:
    for setting, colour in SETTINGS.items():
        rows = [r for r in ratios["rows"] if r["setting"] == setting]
        x = [r["bend_ratio"] for r in rows]
        about = f"{setting} ({rows[0]['leg_mm']:g} mm, gap {rows[0]['gap_mm']:g} mm)"
        for quantity, (name, style) in QUANTITIES.items():
            y = [r[quantity] for r in rows]
            sides = [[r[f"{quantity}_{side}"] for r in rows] for side in ("low", "high")]
            panel.fill_between(x, *sides, color=colour, alpha=0.2, lw=0)
            panel.plot(x, y, color=colour, ls=style, marker=".", label=f"{about}: {name}")
    middle = [(r["earlier_low"] + r["earlier_high"]) / 2 for r in earlier]
    half = [(r["earlier_high"] - r["earlier_low"]) / 2 for r in earlier]
    at = [r["bend_ratio"] for r in earlier]
    panel.errorbar(
        at,
        middle,
        yerr=half,
        fmt="none",
        ecolor=INK,
        capsize=5,
        lw=1.6,
        zorder=5,
        label="earlier prototype, plain, short legs: into the gel",
    )
    panel.axhline(1.0, color=INK, lw=0.8)
    panel.axvline(ratios["own_bend_ratio"], color=INK, lw=0.8, ls=":")
    panel.set_xlabel("bend radius over thickness, R/t   (dotted: gelslim2)")
    panel.set_ylabel("curved guide over glued mirror")
    panel.set_title(
        f"(c) brighter or darker than glued 45° mirrors of {ratios['mirror_reflectance']:g}? "
        "It depends",
        fontsize=10,
        loc="left",
    )
    panel.set_xlim(left=0)
    panel.set_ylim(0, 2)
    panel.legend(frameon=False, fontsize=7.5, loc="lower right")
    panel.grid(**GRID)
