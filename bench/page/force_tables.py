"""Tables of the force pipeline from docs/data/force_latency.json and force_ladders.json."""

from __future__ import annotations

from typing import Any

SHORT = {
    "any object, gel auto": "any object, from light and markers, to a quarter of the thickness",
    "any object": "the same with `--gel linear`, or less than a tenth of the thickness deep",
    "any object, on nodes": "the same, and with `--no-finer-pressure`",
    "depth given, gel auto": "depth given",
    "depth given, 25%": "the same with `--gel linear --error 25%`",
    "tangential, 25%": "tangential forces alone (`--indenter none`)",
    "sphere seen, gel auto": "only the ball's size given, contact found in the picture",
    "paper's choices": "the paper's choices, with our detector",
}
CLOCKS = {"wall": "", "processor": "of the processor "}
STAGES = {
    "track": "find and match markers",
    "drift": "drift of the camera",
    "look": "find the contact",
    "normal": "normal motion",
    "displace": "compensate projection",
    "interpolate": "markers to nodes",
    "force": "forces",
    "wrench": "wrench with σ",
}


def full_latency(data: dict[str, Any]) -> str:
    """Return the medians per stage of every chain, the first frame and the memory."""
    names = ["total", *STAGES]
    parts = [
        f"Median time in ms {CLOCKS[data['clock']]}per frame of 640 x 480 px on one core "
        f"({data['processor']}). Each "
        f"chain processed {data['frames']} frames of a push and its release; the chains took "
        "turns. The chain with the paper's choices searches the whole frame, takes the nearest "
        "dot, compensates with the printed formula, makes Delaunay triangles in each frame and "
        "has a stiffness of one layer. It uses our detector."
    ]
    if any("own" in row for row in data["chains"]):
        parts[0] += (
            " A frame's own work is its median over the pushes, which leaves out what else the "
            "machine does."
        )
    for count in dict.fromkeys(row["markers"] for row in data["chains"]):
        rows = [row for row in data["chains"] if row["markers"] == count]
        lines = [
            f"| {count} markers, {rows[0]['nodes']} nodes | "
            + " | ".join(r["chain"] for r in rows)
            + " |",
            "|---|" + "---:|" * len(rows),
        ]
        for name in names:
            if not any(name in r for r in rows):
                continue
            cells = [ms(r[name]["median"]) if name in r else "" for r in rows]
            lines.append(f"| {STAGES.get(name, '**whole chain**')} | " + " | ".join(cells) + " |")
        for tail, label in (("p95", "whole chain, 95 %"), ("p99", "whole chain, 99 %")):
            lines.append(f"| {label} | " + " | ".join(ms(r["total"][tail]) for r in rows) + " |")
        if any("own" in r for r in rows):
            cells = [ms(r["own"]["p99"]) if "own" in r else "" for r in rows]
            lines.append(f"| a frame's own work, 99 % | {' | '.join(cells)} |")
        parts.append("\n".join(lines))
    parts.append(tracker_table(data["trackers"]))
    first = data["first_frame"]
    parts.append(
        "A new process whose kernels were compiled before has the wrench of its first frame after "
        f"{first['ready_s']:.2f} s: imports {first['imports_s']:.2f} s, bundle "
        f"{first['bundle_s']:.2f} s, pipeline {first['pipeline_s']:.2f} s, frame "
        f"{first['frame_s']:.2f} s."
    )
    if "soak" in data:
        soak = data["soak"]
        parts.append(
            f"In a run of {soak['frames']:,} frames the memory of the process grew by "
            f"{soak['growth_mb']:+.2f} MB after the first tenth of the frames."
        )
    return "\n\n".join(parts)


def tracker_table(rows: list[dict[str, Any]]) -> str:
    """Return time and error of every tracker, and how much longer it takes than windows."""
    ours = {row["markers"]: row["total"]["median"] for row in rows if row["chain"] == "windows"}
    lines = [
        "| markers | tracker | median, ms | 99 %, ms | 99 % over median | over windows | "
        "error, px | misplaced |",
        "|---:|---|---:|---:|---:|---:|---:|---:|",
    ]
    for row in rows:
        median, tail = row["total"]["median"], row["total"]["p99"]
        cells = [
            f"{row['markers']}",
            row["chain"],
            ms(median),
            ms(tail),
            f"{tail / median:.2f}",
            f"{median / ours[row['markers']]:.2f}",
            f"{row['error_px']:.3f}",
            f"{row['misplaced']:.2%}",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(
        [
            "Finding and matching the markers alone, in the same run as the chains. Windows round "
            "predicted places are what the pipeline searches while all is well; the whole frame is "
            "what it falls back to. OpenCV's blobs are matched to the nearest place in the frame "
            "before. The follower of Lucas and Kanade moves patches of the frame before. The error "
            "is the root mean square distance from the drawn centres of markers less than 2 px "
            "off; the others are misplaced.",
            "",
            *lines,
        ]
    )


def short_latency(data: dict[str, Any]) -> str:
    """Return median and 95 % quantile of a frame for any object, within 25 %, and the paper's."""
    counts = list(dict.fromkeys(row["markers"] for row in data["chains"]))
    lines = [
        "| camera frame to wrench and force field, ms, median (95 %) | "
        + " | ".join(f"{count} markers" for count in counts)
        + " |",
        "|---|" + "---:|" * len(counts),
    ]
    totals = {(row["chain"], row["markers"]): row["total"] for row in data["chains"]}
    for chain, name in SHORT.items():
        of = [totals[chain, count] for count in counts if (chain, count) in totals]
        if not of:
            continue
        cells = [f"{ms(t['median'])} ({ms(t['p95'])})" for t in of]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def ladder_tables(data: dict[str, Any]) -> str:
    """Return one table per ladder."""
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
    """Return a Markdown table of some columns and the time."""
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
    """Return milliseconds with three digits."""
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"
