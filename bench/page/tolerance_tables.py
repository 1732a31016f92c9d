"""Tables of the page on tolerances: yields of the designs, and the causes with their sources."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bench.bench_data import DOCS
from bench.page.page_tables import table

Data = Mapping[str, Any]


def yields(data: Data) -> str:
    """Return the yields of the designs, what limits them, and what would cure it."""
    rows = []
    for found in data["designs"]:
        first, *steps = found["plan"]["steps"]
        changes = ", ".join(
            f"`{path.rpartition('.')[2]}: {_shown(value)}`"
            for path, value in found["plan"]["change"].items()
        )
        last = steps[-1] if steps else first
        rows.append(
            (
                f"`{found['name']}`",
                f"{found['worst_cause']}, {100 * found['worst_share']:.0f} % of "
                f"`{found['worst_rule']}`",
                changes or "nothing",
                *(f"{100 * found['yields'][s]['yield']:.1f} %" for s in ("as_built", "adjusted")),
                f"{100 * last['yield']:.1f} %",
                f"{first['thickness_mm']:.2f} → {last['thickness_mm']:.2f} mm",
            )
        )
    heads = ("design", "worst cause as built", "changes for 95 %", "as built", "adjusted")
    return table((*heads, "changed", "thickness"), rows, words=3)


def _shown(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def forces(data: Data) -> str:
    """Return the errors of the forces of gelslim2 by cause."""
    found = next(x for x in data["designs"] if x["name"] == "gelslim2")["forces"]
    heads = [f"{f['component']}, {'' if f['calibrated'] else 'not '}calibrated" for f in found]
    names = dict.fromkeys(name for f in found for name in f["causes"])
    rows = [
        (name, *(f"{f['causes'][name]:.2f} %" if name in f["causes"] else "" for f in found))
        for name in names
    ]
    rows.append(("all", *(f"{f['deviation_percent']:.1f} %" for f in found)))
    rows.append(("95 % stay below", *(f"{f['most_percent']:.0f} %" for f in found)))
    return table(("cause, alone", *heads), rows)


def causes() -> str:
    """Return the causes of error of gelslim2 with distribution, figure, field and source."""
    from gelslim_cad.dimensions import derive
    from gelslim_cad.spec.reader import read_spec
    from gelslim_cad.tolerance.causes import GROUPS
    from gelslim_cad.tolerance.causes import causes as all_causes

    d = derive(read_spec(DOCS.parent / "designs" / "gelslim2.yaml").spec)
    units = {"mm": "mm", "deg": "°", "percent": "%", "px": "px"}
    rows = []
    for group, entry in GROUPS.items():
        figures = "; ".join(
            f"{c.words} {'σ ' if c.distribution == 'normal' else '±'}{c.spread:.2g} "
            f"{units.get(c.name.rpartition('_')[2], '')}".rstrip()
            + (" (triangular)" if c.distribution == "triangular" else "")
            for c in all_causes(d)
            if c.group == group
        )
        rows.append((group, figures, f"`{entry.field}`", entry.source))
    return table(("causes", "of gelslim2", "field", "where the figure comes from"), rows, words=4)
