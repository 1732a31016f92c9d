"""The report's section on tolerances: yields, causes, force errors, what to change."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gelslim_cad.report.markup import coordinate, number, text

STAGES = {"as_built": "As built", "adjusted": "Adjusted"}
WIDTH = 240.0
SHOWN = 0.005
"""Least share of the variance that gets a bar."""


def tolerance_section(record: Mapping[str, Any]) -> str:
    """The section as HTML.

    Args:
        record: What `gelslim_cad.tolerance.study.study_record` gives; empty where there is none.

    Returns:
        Tables with bars; a sentence where there is no record.
    """
    if not record:
        return '<p class="soft">No tolerances were studied.</p>'
    return "".join(part(record) for part in (_yields, _causes, _forces, _plan))


def _yields(record: Mapping[str, Any]) -> str:
    found, rules = record["yields"], record["rules"]
    rows = [
        [rules[rule]["title"] if rule in rules else "Every rule"]
        + [_interval(found[stage][rule]) for stage in STAGES]
        for rule in found[record["assembly"]]
    ]
    means = " ".join(f"{STAGES[s]}: {record['assembly_means'][s]}" for s in STAGES)
    return (
        f"<h3>Yield of {number(record['samples'])} sampled fingers, 95 % interval</h3>"
        + _table(["Rule", *STAGES.values()], rows)
        + f'<p class="soft">{text(means)} The spec chose: {text(STAGES[record["assembly"]])}.</p>'
    )


def _interval(found: Mapping[str, float]) -> str:
    low, high = (number(100 * found[end], 3) for end in ("low", "high"))
    return f"{number(100 * found['yield'], 3)} % ({low} to {high})"


def _causes(record: Mapping[str, Any]) -> str:
    worst = next(
        v for v in record["variance"] if v["place"].partition("@")[0] == record["worst_rule"]
    )
    fields = {c["group"]: c["field"] for c in record["causes"]}
    listed = sorted(worst["total"], key=lambda g: -worst["total"][g])
    rows = [
        [group, fields[group], f"{number(100 * worst['linear'][group], 2)} %", _bar(worst, group)]
        for group in listed
        if worst["total"][group] >= SHOWN
    ]
    title = record["rules"][record["worst_rule"]]["title"]
    return (
        f"<h3>What moves the rule that fails most: {text(title)}</h3>"
        + _table(["Cause", "Field", "Linear share", "Sobol’s total index"], rows, raw=3)
        + f'<p class="soft">Margin {number(worst["mean"], 3)} ± {number(worst["deviation"], 3)} '
        f"{text(worst['unit'])}; with every error at its limit "
        f"{number(worst['worst_case'], 3)}.</p>"
    )


def _bar(worst: Mapping[str, Any], group: str) -> str:
    share = min(max(worst["total"][group], 0.0), 1.0)
    return (
        f'<svg viewBox="0 0 {WIDTH:g} 12" width="{WIDTH:g}" height="12" role="img" '
        f'aria-label="{number(100 * share, 2)} %"><rect fill="currentColor" opacity=".12" '
        f'width="{WIDTH:g}" height="12"/><rect fill="currentColor" opacity=".55" width="'
        f'{coordinate(share * WIDTH)}" height="12"/></svg> {number(100 * share, 2)} %'
    )


def _forces(record: Mapping[str, Any]) -> str:
    forces = record["forces"]
    if not forces:
        return ""
    heads = [
        f"{f['component'].capitalize()}, {'' if f['calibrated'] else 'not '}calibrated"
        for f in forces
    ]
    names = dict.fromkeys(name for f in forces for name in f["causes"])
    rows = [
        [
            name,
            *(f"{number(f['causes'][name], 3)} %" if name in f["causes"] else "" for f in forces),
        ]
        for name in names
    ]
    rows.append(["All together", *(f"{number(f['deviation_percent'], 3)} %" for f in forces)])
    rows.append(
        ["95 % of the fingers below", *(f"{number(f['most_percent'], 3)} %" for f in forces)]
    )
    return "<h3>Error of the forces, standard deviation</h3>" + _table(["Cause", *heads], rows)


def _plan(record: Mapping[str, Any]) -> str:
    plan = record["plan"]
    rows = [
        [
            step["words"] or "The spec as it is",
            f"{number(100 * step['yield'], 3)} %",
            f"{step['thickness_mm']:.2f} mm",
        ]
        for step in plan["steps"]
    ]
    change = ", ".join(f"{path}: {number(value)}" for path, value in plan["change"].items())
    said = f"To change: {change}." if change else "Nothing need change."
    if not plan["reached"]:
        said += " No usual change goes further."
    return (
        f"<h3>What gives a yield of {number(100 * plan['least_yield'], 3)} %</h3>"
        + _table(["Change", "Yield", "Thickness"], rows)
        + f'<p class="soft">{text(said)}</p>'
    )


def _table(heads: list[str], rows: list[list[str]], raw: int = -1) -> str:
    """A table of text; the column `raw` holds markup."""
    head = "".join(f"<th>{text(h)}</th>" for h in heads)
    body = "".join(
        "<tr>"
        + "".join(f"<td>{cell if k == raw else text(cell)}</td>" for k, cell in enumerate(row))
        + "</tr>"
        for row in rows
    )
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    return f'<div class="card scroll">{table}</div>'
