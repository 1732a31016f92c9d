"""Figure and text of what planning saves, from docs/data/twin_planning.json alone."""

from __future__ import annotations

from statistics import median
from typing import Any

Rows = dict[str, dict[str, Any]]
LEVELS = {"loose": "10 %", "own": "own", "tight": "1 %"}
COLOURS = {"loose": "#2d8a57", "own": "#1f4e8c", "tight": "#c4580a"}
EVERYTHING, ALLOWED = "#999999", "#c03060"
LEAST_USED = 1e-3
"""Where an error of nothing is drawn, as a share of the tolerance."""
TICKS_MS = (20, 50, 100, 200, 400)


def draw(cases: Rows) -> bytes:
    """Time per pose of the gallery at three tolerances; time against used tolerance of all."""
    from gelslim_core.figure import as_png, new_figure

    figure, (left, right) = new_figure(13.0, 6.0, columns=2)
    _draw_gallery(left, gallery(cases))
    _draw_all(right, cases)
    marks, texts = left.get_legend_handles_labels()
    figure.legend(marks, texts, fontsize=9, frameon=False, loc="outside lower center", ncols=4)
    return as_png(figure)


def _draw_gallery(panel: Any, scenes: dict[str, Rows]) -> None:
    names, told = sorted(scenes, reverse=True), set[str]()
    for place, name in enumerate(names):
        rows = scenes[name]
        whole = max(r["whole_ms"] / r["poses"] for r in rows.values())
        panel.plot([whole], [place], "|", ms=16, mew=2, color=EVERYTHING,
                   label="everything on" if place == 0 else None)  # fmt: skip
        for level in LEVELS:
            if level in rows:
                ms = whole_ms(rows[level]) / rows[level]["poses"]
                panel.plot([ms], [place], "o", ms=7, color=COLOURS[level],
                           label=None if level in told else label(level))  # fmt: skip
                told.add(level)
        panel.axhline(place, color="#eeeeee", lw=1, zorder=0)
    panel.set_yticks(range(len(names)), names)
    panel.set_xscale("log")
    panel.set_xticks(TICKS_MS, [f"{ms:g}" for ms in TICKS_MS])
    panel.xaxis.set_minor_formatter("")
    panel.set_xlabel("ms per pose, planning and probe included")


def _draw_all(panel: Any, cases: Rows) -> None:
    kinds = {level: f" {level}" for level in LEVELS}
    for level, ending in kinds.items():
        rows = [r for name, r in cases.items() if name.endswith(ending) and "used" in r]
        panel.scatter(*_points(rows), s=28, color=COLOURS[level], zorder=3)
    rows = [r for name, r in cases.items() if name.startswith("seed") and "used" in r]
    panel.scatter(*_points(rows), s=18, facecolors="none", edgecolors="#555555", zorder=2,
                  label="random scene")  # fmt: skip
    panel.axhline(1.0, color=ALLOWED, lw=1, ls="--")
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_xlabel("time over that of everything on")
    panel.set_ylabel("error over tolerance")
    panel.legend(fontsize=9, frameon=False, loc="lower left")


def _points(rows: list[dict[str, Any]]) -> tuple[list[float], list[float]]:
    return [ratio(r) for r in rows], [max(LEAST_USED, used(r)) for r in rows]


def label(level: str) -> str:
    """What a tolerance of the gallery is called."""
    return "own tolerance" if level == "own" else f"tolerance of {LEVELS[level]}"


def gallery(cases: Rows) -> dict[str, Rows]:
    """The rows of the gallery by scene, and by tolerance."""
    found: dict[str, Rows] = {}
    for name, row in cases.items():
        if "scene" in row and "used" in row:
            found.setdefault(row["scene"], {})[name.rpartition(" ")[2]] = row
    return found


def whole_ms(row: dict[str, Any]) -> float:
    """Time of the planner's choice with planning and probe."""
    return float(row["ms"] + row["planning_ms"])


def ratio(row: dict[str, Any]) -> float:
    """Time of the planner's choice over that of everything on, planning and probe included."""
    return whole_ms(row) / float(row["whole_ms"])


def used(row: dict[str, Any]) -> float:
    """Largest error of any observable over its tolerance."""
    return float(max(row["used"].values()))


def _of_promised(row: dict[str, Any]) -> float:
    """The error found over the one that the plan promises, where each is largest."""
    return used(row) / max([*row["promised"].values(), 1e-12])


def table(data: dict[str, Any]) -> str:
    """The tables of the guide."""
    cases: Rows = data["cases"]
    scenes = gallery(cases)
    lines = [
        "| scene | poses | everything on, ms | " + " | ".join(label(v) for v in LEVELS) + " |",
        "|---|---:|---:|" + "---|" * len(LEVELS),
    ]
    for name, rows in scenes.items():
        first = next(iter(rows.values()))
        cells = [_cell(rows[v]) if v in rows else "" for v in LEVELS]
        most = max(r["whole_ms"] / r["poses"] for r in rows.values())
        lines.append(f"| `{name}` | {first['poses']} | {most:.3g} | " + " | ".join(cells) + " |")
    done = [r for name, r in cases.items() if name.startswith("seed") and "used" in r]
    shown = [r for rows in scenes.values() for r in rows.values()]
    texts = [
        "Each cell gives the time over that of everything on (planning and probe included), the "
        "share of the tolerance that is used, and what is done about large strain. Times are CPU "
        f"time of one thread per pose ({data['processor']}); everything on takes each effect by "
        "the rung that the tolerance asks for.",
        "\n".join(lines),
        _summary("The gallery at its three tolerances", shown),
    ]
    refused = sum("refused" in r and "seed" in r for r in cases.values())
    if done:
        what = f"{len(done)} random scenes at random tolerances from 0.5 to 20 %"
        texts.append(_summary(what, done) + (f" {refused} more are refused." if refused else ""))
        whole = [*shown, *done]
        texts.append(
            f"All {len(whole)} cases together take {median(map(ratio, whole)):.2f} of the time of "
            f"everything on in the median and use {median(map(used, whole)):.0%} of the tolerance; "
            f"of what the plans promise, {median(map(_of_promised, whole)):.0%} in the median and "
            f"{max(map(_of_promised, whole)):.0%} at most."
        )
    return "\n\n".join(texts)


def _cell(row: dict[str, Any]) -> str:
    strain = row["chosen"].get("nonlinearity", "linear")
    return f"{ratio(row):.2f}; {used(row):.0%}; {strain}"


def _summary(what: str, rows: list[dict[str, Any]]) -> str:
    above = sum(used(r) > 1 for r in rows)
    doubtful = sum(r.get("with_doubtful", used(r)) > 1 for r in rows)
    judged = [r for r in rows if r["needless"] is not None]
    kept, needless = (sum(r["kept"] for r in judged), sum(len(r["needless"]) for r in judged))
    spare = f"; {needless} of {kept} effects are kept without need" if judged else ""
    if all("needless_at_once" in r for r in judged) and judged:
        spare += f", {sum(r['needless_at_once'] for r in judged)} of which could go at once"
    ratios = sorted(ratio(r) for r in rows)
    probed = [r for r in rows if r["probed"]]
    share = median(r["planning_ms"] / r["whole_ms"] for r in probed) if probed else 0.0
    more = (
        f" ({doubtful} with the dots whose centres the detector calls doubtful)"
        if doubtful > above
        else ""
    )
    return (
        f"{what}: {above} of {len(rows)} are above the tolerance{more}; the median uses "
        f"{median(used(r) for r in rows):.0%} of it and takes {median(ratios):.2f} of the time of "
        f"everything on, the quickest tenth at most {ratios[len(ratios) // 10]:.2f}{spare}. "
        f"Planning with a probe ({len(probed)} of {len(rows)}) takes {share:.1%} of the time of "
        "everything on in the median."
    )
