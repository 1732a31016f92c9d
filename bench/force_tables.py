"""Put the measured tables into guide and README, between their comment marks.

python bench/force_tables.py    # from docs/data/force_latency.json and force_ladders.json
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
DATA = ROOT / "docs" / "data"
GUIDE = ROOT / "docs" / "force_pipeline.md"
README = ROOT / "README.md"
SHORT = {
    "depth given, 5%": "depth given",
    "tangential, 5%": "nothing given: normal force unknown",
    "sphere seen, 5%": "only the ball's size given, contact sought in the picture",
    "paper's choices": "the paper's choices, with our detector",
}
STAGES = {
    "track": "find and match markers",
    "look": "find the contact patch",
    "normal": "normal motion",
    "displace": "compensate projection",
    "interpolate": "markers to nodes",
    "force": "forces",
    "wrench": "wrench with σ",
}


def main() -> None:
    """Write what has been measured."""
    latency = DATA / "force_latency.json"
    if latency.exists():
        data = json.loads(latency.read_text(encoding="utf-8"))
        replace_between(GUIDE, "latency", full_latency(data))
        replace_between(README, "latency", short_latency(data))
    ladders = DATA / "force_ladders.json"
    if ladders.exists():
        replace_between(
            GUIDE, "ladders", ladder_tables(json.loads(ladders.read_text(encoding="utf-8")))
        )


def replace_between(path: Path, mark: str, text: str) -> None:
    """Replace what stands between the marks; a file without them is left alone."""
    whole = path.read_text(encoding="utf-8")
    first, last = f"<!-- {mark} -->", f"<!-- /{mark} -->"
    if first not in whole or last not in whole:
        print(f"{path.name} has no marks for {mark}")
        return
    before, rest = whole.split(first, 1)
    path.write_text(
        f"{before}{first}\n{text.strip()}\n{last}{rest.split(last, 1)[1]}", encoding="utf-8"
    )


def full_latency(data: dict[str, Any]) -> str:
    """Medians per stage of every chain, and what was measured besides."""
    names = ["total", *STAGES]
    parts = [
        f"Median ms per 640 x 480 frame on one core ({data['processor']}; {data['frames']} frames "
        "of a push and its release per chain, chains in turns). The paper's chain: whole frame "
        "searched, nearest dot, printed compensation, Delaunay triangles in each frame, stiffness "
        "of one layer; with our detector."
    ]
    for count in dict.fromkeys(row["markers"] for row in data["chains"]):
        rows = [row for row in data["chains"] if row["markers"] == count]
        lines = [
            f"| {count} markers, {rows[0]['nodes']} nodes | "
            + " | ".join(r["chain"] for r in rows)
            + " |",
            "|---|" + "---:|" * len(rows),
        ]
        for name in names:
            cells = [ms(r[name]["median"]) if name in r else "" for r in rows]
            lines.append(f"| {STAGES.get(name, '**whole chain**')} | " + " | ".join(cells) + " |")
        for tail, label in (("p95", "whole chain, 95 %"), ("p99", "whole chain, 99 %")):
            lines.append(f"| {label} | " + " | ".join(ms(r["total"][tail]) for r in rows) + " |")
        parts.append("\n".join(lines))
    first = data["first_frame"]
    parts.append(
        f"A fresh process has the wrench of its first frame after {first['ready_s']:.2f} s "
        f"(imports {first['imports_s']:.2f}, bundle {first['bundle_s']:.2f}, pipeline "
        f"{first['pipeline_s']:.2f}, frame {first['frame_s']:.2f}; compiled before)."
    )
    if "soak" in data:
        soak = data["soak"]
        parts.append(
            f"Over {soak['frames']:,} frames the process grew by {soak['growth_mb']:+.2f} MB after "
            "the first tenth."
        )
    return "\n\n".join(parts)


def short_latency(data: dict[str, Any]) -> str:
    """Medians and 95 % of a frame for the chains within 5 %, and the paper's."""
    counts = list(dict.fromkeys(row["markers"] for row in data["chains"]))
    lines = [
        "| camera frame to wrench and force field, ms, median (95 %) | "
        + " | ".join(f"{count} markers" for count in counts)
        + " |",
        "|---|" + "---:|" * len(counts),
    ]
    totals = {(row["chain"], row["markers"]): row["total"] for row in data["chains"]}
    for chain, told in SHORT.items():
        of = [totals[chain, count] for count in counts]
        cells = [f"{ms(t['median'])} ({ms(t['p95'])})" for t in of]
        lines.append(f"| {told} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def ladder_tables(data: dict[str, Any]) -> str:
    """One table per ladder."""
    parts = [
        table(
            data["detection"],
            {"look": "frame", "detector": "detector"},
            {
                "error_px": ("error, px", 3),
                "missed": ("missed", "%"),
                "spurious": ("spurious", "%"),
            },
        ),
        table(
            data["matching"],
            {"peak_pitch": "largest motion, pitches", "mode": "matching"},
            {"wrong": ("wrong", "%"), "tracked": ("tracked", "%")},
        ),
        table(
            data["interpolation"],
            {"interpolation": "interpolation"},
            {"error": ("error", "%"), "error_noisy": ("with 2 µm of noise", "%")},
        ),
        table(
            data["operators"],
            {"gel": "truth", "operator": "operator", "method": "method"},
            {"error_field": ("field", "%"), "error_resultant": ("resultant", "%")},
        ),
        table(
            data["compensation"],
            {"compensation": "compensation"},
            {"error_mm": ("error, mm", 4), "shear_error_n": ("shear, N", 4)},
        ),
    ]
    return "\n\n".join(parts)


def table(rows: list[dict[str, Any]], labels: dict[str, str], values: dict[str, Any]) -> str:
    """Markdown of some columns and the time."""
    heads = [*labels.values(), *(head for head, _ in values.values()), "ms"]
    lines = [
        "| " + " | ".join(heads) + " |",
        "|---" * len(labels) + "|---:" * (len(values) + 1) + "|",
    ]
    for row in rows:
        cells = [str(row[key]) for key in labels]
        for key, (_, digits) in values.items():
            value = row[key]
            cells.append(f"{value:.2%}" if digits == "%" else f"{value:.{digits}f}")
        lines.append("| " + " | ".join([*cells, ms(row["milliseconds"])]) + " |")
    return "\n".join(lines)


def ms(value: float) -> str:
    """Three digits."""
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


if __name__ == "__main__":
    main()
