"""The report's section on the assembly: each step with its way, its gap and its screws."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from gelslim_cad.assembly.record import read_steps
from gelslim_cad.assembly.words import way_in_words
from gelslim_cad.report.markup import number, text


def assembly_section(record: Mapping[str, Any]) -> str:
    """The section as HTML.

    Args:
        record: What `gelslim_cad.assembly.record.assembly_record` gives; empty where there is none.

    Returns:
        A summary, and a folded table of the steps; a sentence where there is no record.
    """
    if not record:
        return '<p class="soft">No order of assembly was proved.</p>'
    steps = record["steps"]
    drivers = sum(f["driver"] is not None for s in steps for f in s["fasteners"])
    rows = "".join(_row(s, record) for s in steps)
    heads = ("", "Step", "Moves", "Way", "Least gap", "Held by", "Screws, inserts, nuts")
    head = "".join(f"<th>{h}</th>" for h in heads)
    return (
        f"<p>{len(steps)} steps. The swept path of every step is free of all that is in place "
        f"before; an overlap deeper than {number(record['overlap_found_mm'])} mm would have been "
        f"found. A driver reaches each of the {drivers} screws. Ways are given with the gel "
        "upwards; they end where the part is assembled.</p>"
        f'<details class="card steps"><summary>All steps</summary><div class="scroll"><table>'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div></details>"
        f'<p class="soft">Least gap: tried were {_gaps(record)} mm around the moving parts, up to '
        f"{number(record['gap_ends_before_seat_mm'])} mm before their seat; 0 means that a part "
        "slides along another.</p>"
    )


def _gaps(record: Mapping[str, Any]) -> str:
    return ", ".join(number(gap) for gap in record["gaps_tried_mm"])


def _row(step: Mapping[str, Any], record: Mapping[str, Any]) -> str:
    (known,) = read_steps({"steps": [step]})
    cells = [
        text(step["key"].replace("_", " ")),
        _names(step["moves"]),
        text(way_in_words(known.way)) if step["moves"] else "",
        _gap(step, record) if step["moves"] else "",
        text(step["held_by"]),
        _fasteners(step["fasteners"]),
    ]
    return (
        f'<tr><td class="num">{step["number"]}</td>'
        + "".join(f"<td>{cell}</td>" for cell in cells)
        + "</tr>"
    )


def _names(names: Sequence[str]) -> str:
    shown = " ".join(f"<code>{text(name)}</code>" for name in names[:3])
    return shown + (f" and {len(names) - 3} more" if len(names) > 3 else "")


def _gap(step: Mapping[str, Any], record: Mapping[str, Any]) -> str:
    if not step["closest"]:
        return f"≥ {number(max(record['gaps_tried_mm']))} mm"
    first, second = (text(name) for name in step["closest"])
    return f"{number(step['gap_mm'])} mm <small>{first} / {second}</small>"


def _fasteners(fasteners: Sequence[Mapping[str, Any]]) -> str:
    kinds = Counter(
        (f["part"].rsplit("_", 1)[0], "" if f["driver"] is None else f["driver"]["name"])
        for f in fasteners
    )
    return "<br>".join(
        f"{count} × {text(kind)}" + (f": {text(driver)}, free" if driver else "")
        for (kind, driver), count in kinds.items()
    )
