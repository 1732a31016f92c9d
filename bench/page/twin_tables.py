"""Tables of the digital twin from docs/data/twin_ladders.json and twin_validation.json."""

from __future__ import annotations

from typing import Any

from bench.page.force_tables import ms

UNITS = {"force_n": "N", "displacement_px": "px", "markers_px": "px", "image_px": "px"}
Rows = list[dict[str, Any]]


def where(data: dict[str, Any], part: str) -> str:
    """Return on what machine, and under what load, a part was measured."""
    return (
        f"Times are medians of the CPU time of one thread ({data['processor']}, load "
        f"{data['load_average'][part]:g} on {data['cores']} cores)"
    )


PARTS = {
    "gel": ("normal_contact", "friction", "relaxation", "nonlinearity"),
    "light": ("refraction", "shading", "marker_print", "dirt"),
}
"""One table each, and one for the other effects: all in one would be too wide to read."""


def scenes_text(data: dict[str, Any]) -> str:
    """Return the effects by scene."""
    rows = data["effects"]
    scenes = list(dict.fromkeys(r["scene"] for r in rows))
    effects = list(dict.fromkeys(r["effect"] for r in rows))
    lines = [
        "Each cell gives the milliseconds per pose or frame without → with the effect, and the "
        "largest error of leaving it out. It is **bold** where the bounds alone include the "
        f"effect. At most {data['poses_at_most']} poses of a scene were solved, each with the path "
        f"to it from the one before. {where(data, 'scenes')}.",
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
    return "\n".join(lines)


def effect_cell(row: dict[str, Any]) -> str:
    """Return times and the error as force and as picture."""
    errors = [
        f"{row['error'][key]:.2g} {unit}"
        for key, unit in UNITS.items()
        if row["error"].get(key, 0.0) > 0 and key != "displacement_px"
    ]
    text = f"{ms(row['ms_without'])} → {ms(row['ms_with'])}; {', '.join(errors)}"
    return f"**{text}**" if row["auto"] == "in" else text


def contact_text(data: dict[str, Any]) -> str:
    """Return three ladders, without and with friction side by side."""
    texts = [
        "The scene is `shear_sphere` with a linear gel. The error of the field is the relative L2 "
        f"error of the nodal forces. {where(data, 'contact')}."
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
    """Return field error, resultant error and time of one rung."""
    if row is None:
        return ["", "", ""]
    if "failed" in row:
        return ["not found", "", ""]
    return [f"{row['field_error']:.1e}", f"{row['resultant_error_n']:.1e}", ms(row["ms"])]


def marks(row: dict[str, Any]) -> list[str]:
    """Return who chooses this rung."""
    if row.get("auto"):
        return [f"(planner, μ {row['friction']:g})"]
    return ["(the design's)"] if row.get("design") else []


def overhead_text(data: dict[str, Any]) -> str:
    """Return the cost of planning and records as sentences."""
    part = data["overhead"]
    low, high = part["quartiles"]
    return (
        f"The scene `{part['scene']}` with {part['poses']} poses and pictures, written to disk, "
        f"takes {part['planned_ms']:.0f} ms of CPU time when it is planned. A loop with the same "
        f"stages written by hand takes {part['by_hand_ms']:.0f} ms and gives the same bytes. "
        f"Plan, key and records, which that loop does not have, take {part['bookkeeping_ms']:.1f} "
        f"ms on their own, {part['bookkeeping']:.2%} of the run; the plan alone takes "
        f"{part['plan_ms']:.1f} ms. Whole runs differ by more than that by chance: the smallest "
        f"times of both differ by {part['overhead']:+.2%}, and the ratios of {part['pairs']} "
        f"pairs of runs have the median {part['median']:+.2%} and the quartiles {low:+.2%} and "
        f"{high:+.2%} (load {data['load_average']['overhead']:g} on {data['cores']} cores)."
    )


def validation_text(data: dict[str, Any]) -> str:
    """Return the errors of each chain, the error budget, and the other contacts."""
    paper, seconds = data["paper"], data["seconds"]
    load = data.get("load_average")
    busy = f" (load {load:g})" if load else ""
    took = f", {seconds} s on {data['cores']} cores{busy}" if seconds else ""
    texts = [
        f"`{data['design']}`, seed {data['seed']}{took}. {data['truth']}",
        "\n".join(
            [
                "| chain | σ of F_x, F_y, F_z, N | bias, N | part of the force | frames in 15 % "
                "| field error | outside the patch | centre, mm | direction |",
                "|---|---|---|---:|---:|---:|---:|---:|---:|",
                f"| the paper, measured | {three(paper['deviation_n'])} | "
                f"| {paper['relative']:.0%} | | | | | |",
                *(spread_line(s) for s in data["chains"]),
            ]
        ),
    ]
    if data.get("budget"):
        lines = [
            "| error budget, one source at a time | σ, N | bias, N | part of the force |",
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
            "| other contacts | chain | true, N | found, N | field error |",
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
    """Return the row of one chain."""
    centre, turn = s["centre_error_mm"], s["direction_error_deg"]
    return (
        f"| {s['name']} | {three(s['deviation_n'])} | {three(s['bias_n'])} "
        f"| {percent(s['relative'])} | {percent(s.get('within'))} | {percent(s['field_error'])} "
        f"| {percent(s['outside_share'])} | {'' if centre is None else f'{centre:.2f}'} "
        f"| {'' if turn is None else f'{turn:.1f}°'} |"
    )


def three(values: list[float | None]) -> str:
    """Return newtons along x, y, z; a dash stands for an unknown value."""
    return ", ".join("–" if v is None else f"{v:.3f}" for v in values)


def percent(value: float | None) -> str:
    """Return a share in per cent, or nothing."""
    return "" if value is None else f"{value:.0%}"
