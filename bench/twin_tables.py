"""Put the twin's measured tables into its guide, between their comment marks.

python bench/twin_tables.py    # from docs/data/twin_ladders.json and twin_validation.json
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from force_tables import ms, replace_between

ROOT = Path(__file__).parents[1]
DATA = ROOT / "docs" / "data"
LADDERS, VALIDATION = DATA / "twin_ladders.json", DATA / "twin_validation.json"
GUIDE = ROOT / "docs" / "digital_twin.md"
UNITS = {"force_n": "N", "displacement_px": "px", "markers_px": "px", "image_px": "px"}
Rows = list[dict[str, Any]]


def main() -> None:
    """Write what has been measured."""
    for mark, text in blocks().items():
        replace_between(GUIDE, mark, text)


def blocks() -> dict[str, str]:
    """Text per mark of the guide."""
    found: dict[str, str] = {}
    if LADDERS.exists():
        data = json.loads(LADDERS.read_text(encoding="utf-8"))
        makers = {"drops": scenes_text, "contact": contact_text, "overhead": overhead_text}
        marks = {"drops": "twin-effects", "contact": "twin-contact", "overhead": "twin-overhead"}
        found |= {marks[key]: make(data) for key, make in makers.items() if key in data}
    if VALIDATION.exists():
        found["validation"] = validation_text(json.loads(VALIDATION.read_text(encoding="utf-8")))
    return found


def where(data: dict[str, Any], part: str) -> str:
    """Machine and load in words."""
    return (
        f"{data['processor']}, CPU time of one thread, medians; other work on the machine (load "
        f"{data['load_average'][part]:g} on {data['cores']} cores)"
    )


PARTS = {
    "gel": ("normal_contact", "friction", "relaxation", "nonlinearity"),
    "light": ("refraction", "shading", "marker_print", "dirt"),
}
"""One table each, and one for the other effects: all in one would be too wide to read."""


def scenes_text(data: dict[str, Any]) -> str:
    """Effects by scene, and the planner's choice by scene."""
    rows = data["effects"]
    scenes = list(dict.fromkeys(r["scene"] for r in rows))
    effects = list(dict.fromkeys(r["effect"] for r in rows))
    lines = [
        f"Milliseconds per pose or frame without → with the effect, and the largest error of "
        f"leaving it out, by scene and effect; **bold** where the planner takes it in. At most "
        f"{data['poses_at_most']} poses of a scene, each with the way to it from the last; "
        f"{where(data, 'scenes')}.",
        "",
    ]
    by = {(r["scene"], r["effect"]): r for r in rows}
    shown = {e for group in PARTS.values() for e in group}
    last = [e for e in effects if e not in shown]
    for part, group in {**PARTS, "camera": last}.items():
        here = [e for e in group if e in effects]
        lines += [f"| {part} | " + " | ".join(f"`{e}`" for e in here) + " |"]
        lines += ["|---|" + "---|" * len(here)]
        for scene in scenes:
            cells = [effect_cell(by[scene, e]) if (scene, e) in by else "" for e in here]
            if any(cells):
                lines.append(f"| `{scene}` | " + " | ".join(cells) + " |")
        lines.append("")
    lines += choice_lines(data["drops"])
    return "\n".join(lines)


def effect_cell(row: dict[str, Any]) -> str:
    """Times, and the error as force and as picture."""
    errors = [
        f"{row['error'][key]:.2g} {unit}"
        for key, unit in UNITS.items()
        if row["error"].get(key, 0.0) > 0 and key != "displacement_px"
    ]
    text = f"{ms(row['ms_without'])} → {ms(row['ms_with'])}; {', '.join(errors)}"
    return f"**{text}**" if row["auto"] == "in" else text


def choice_lines(drops: Rows) -> list[str]:
    """What the planner's choice costs and misses, beside everything on."""
    lines = [
        "| scene | everything on, ms | planner, ms | error of the planner's choice | tolerance "
        "used |",
        "|---|---:|---:|---|---:|",
    ]
    for scene in dict.fromkeys(r["scene"] for r in drops):
        here = {r["label"]: r for r in drops if r["scene"] == scene}
        whole, auto = here["everything on"], here["auto"]
        errors = ", ".join(
            f"{o} {v:.2g} {'N' if o == 'force' else 'px'}" for o, v in auto["error"].items()
        )
        lines.append(
            f"| `{scene}` | {ms(whole['ms'])} | {ms(auto['ms'])} | {errors} "
            f"| {auto['of_tolerance']:.0%} |"
        )
    return lines


def contact_text(data: dict[str, Any]) -> str:
    """Three ladders, without and with friction side by side."""
    texts = [
        f"`shear_sphere` in a linear gel. Field: relative L2 error of the nodal forces; "
        f"{where(data, 'contact')}."
    ]
    kinds = [
        ("tolerance", "contact", "solver tolerance (against 1e-9)", "ms per pose"),
        ("steps", "steps", "steps per movement (against many, last pose)", "ms per path"),
    ]
    if "layers" in data:
        against = data["layers"][0]["against"]
        kinds.append(("layers", "layers", f"mesh layers (against {against})", "ms per pose"))
    for knob, key, title, time in kinds:
        rows, layered = data[key], knob == "layers"
        extra = " set-up, s |" if layered else ""
        lines = [
            f"| {title} | field, frictionless | N | {time} | field, μ 0.6 | N | {time} |{extra}",
            "|---|" + "---:|" * (7 if layered else 6),
        ]
        by = {(r["friction"], r[knob]): r for r in rows}
        for rung in dict.fromkeys(r[knob] for r in rows):
            cells = [*contact_cells(by.get((0.0, rung))), *contact_cells(by.get((0.6, rung)))]
            if layered:
                cells.append(f"{by[0.0, rung]['setup_s']:.1f}")
            marked = [m for r in rows if r[knob] == rung for m in marks(r)]
            label = " ".join([f"{rung:g}", *dict.fromkeys(marked)])
            lines.append(f"| {label} | " + " | ".join(cells) + " |")
        texts.append("\n".join(lines))
    return "\n\n".join(texts)


def contact_cells(row: dict[str, Any] | None) -> list[str]:
    """Field, resultant, time of one rung."""
    if row is None:
        return ["", "", ""]
    if "failed" in row:
        return ["not found", "", ""]
    return [f"{row['field_error']:.1e}", f"{row['resultant_error_n']:.1e}", ms(row["ms"])]


def marks(row: dict[str, Any]) -> list[str]:
    """Who takes this rung."""
    if row.get("auto"):
        return [f"(planner, μ {row['friction']:g})"]
    return ["(the design's)"] if row.get("design") else []


def overhead_text(data: dict[str, Any]) -> str:
    """One sentence."""
    part = data["overhead"]
    low, high = part["quartiles"]
    return (
        f"`{part['scene']}`, {part['poses']} poses with pictures, written to disk: "
        f"{part['planned_ms']:.0f} ms of CPU planned, {part['by_hand_ms']:.0f} ms by a loop with "
        f"the same stages written by hand, the same bytes. What the loop does without, plan, key "
        f"and records, takes {part['bookkeeping_ms']:.1f} ms on its own, {part['bookkeeping']:.2%} "
        f"(the plan {part['plan_ms']:.1f} ms). Whole runs scatter by more: their least times "
        f"differ by {part['overhead']:+.2%}; of the ratios of {part['pairs']} pairs in turns the "
        f"median is {part['median']:+.2%}, the quartiles {low:+.2%} and {high:+.2%} "
        f"(load {data['load_average']['overhead']:g} on {data['cores']} cores)."
    )


def validation_text(data: dict[str, Any]) -> str:
    """Spread per chain beside the paper's, the budget, and the other contacts."""
    paper, seconds = data["paper"], data["seconds"]
    load = data.get("load_average")
    busy = f" shared with other work (load {load:g})" if load else ""
    took = f", {seconds} s on {data['cores']} cores{busy}" if seconds else ""
    texts = [
        f"`{data['design']}`, seed {data['seed']}{took}. {data['truth']}",
        "\n".join(
            [
                "| chain | σ of F_x, F_y, F_z, N | bias, N | of the force | frames within 15 % "
                "| field off | outside the patch | centre, mm | direction |",
                "|---|---|---|---:|---:|---:|---:|---:|---:|",
                f"| the paper, measured | {three(paper['deviation_n'])} | "
                f"| {paper['relative']:.0%} | | | | | |",
                *(spread_line(s) for s in data["chains"]),
            ]
        ),
    ]
    if data.get("budget"):
        lines = [
            "| error budget, each alone | σ, N | bias, N | of the force |",
            "|---|---|---|---:|",
        ]
        lines += [
            f"| {s['name']} | {three(s['deviation_n'])} | {three(s['bias_n'])} "
            f"| {percent(s['relative'])} |"
            for s in data["budget"]
        ]
        texts.append("\n".join(lines))
    if data.get("other_contacts"):
        lines = [
            "| other contacts | chain | true, N | found, N | field off |",
            "|---|---|---|---|---:|",
        ]
        for name, scores in data["other_contacts"].items():
            lines += [
                f"| {name} | {s['chain']} | {three(s['true_n'])} | {three(s['found_n'])} "
                f"| {percent(s['field_error'])} |"
                for s in scores
            ]
        texts.append("\n".join(lines))
    return "\n\n".join(texts)


def spread_line(s: dict[str, Any]) -> str:
    """One chain."""
    centre, turn = s["centre_error_mm"], s["direction_error_deg"]
    return (
        f"| {s['name']} | {three(s['deviation_n'])} | {three(s['bias_n'])} "
        f"| {percent(s['relative'])} | {percent(s.get('within'))} | {percent(s['field_error'])} "
        f"| {percent(s['outside_share'])} | {'' if centre is None else f'{centre:.2f}'} "
        f"| {'' if turn is None else f'{turn:.1f}°'} |"
    )


def three(values: list[float | None]) -> str:
    """Newtons along x, y, z; what is not known is a dash."""
    return ", ".join("–" if v is None else f"{v:.3f}" for v in values)


def percent(value: float | None) -> str:
    """Or nothing."""
    return "" if value is None else f"{value:.0%}"


if __name__ == "__main__":
    main()
