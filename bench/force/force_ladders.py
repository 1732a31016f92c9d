"""Error against time of every step from picture to force, with what others would take for it.

    python -m bench.force.force_ladders            # writes docs/data and docs/images
    python -m bench.force.force_ladders --quick    # fewer frames and draws, prints only

Detection, matching, interpolation, operator with force method, compensation: on drawn frames and
presses whose truth comes from a mesh of half the pitch with eight layers. Set OMP_NUM_THREADS=1.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from bench.bench_data import DOCS, write_data, write_whole
from bench.rigs.force_ladder_fields import (
    METHODS,
    OPERATORS,
    compensation,
    interpolation,
    operators,
)
from bench.rigs.force_ladder_markers import LOOKS, MISSING, SPURIOUS, detection, matching
from bench.rigs.force_rig import SEED, small_rig
from bench.rigs.machine import machine

Rows = list[dict[str, Any]]
LADDERS = {
    "detection": detection,
    "matching": matching,
    "interpolation": interpolation,
    "operators": operators,
    "compensation": compensation,
}
LABELS = ("look", "detector", "mode", "peak_pitch", "interpolation", "gel", "operator", "method",
          "compensation")  # fmt: skip
COLOURS = ("#1f4e8c", "#c4580a", "#2d8a57", "#7a3f8f", "#b59b00", "#555555", "#c03060", "#30a0b0")
MARKS = {"clean": "o", "noise 8": "s", "blur 1.5 px": "D", "direct": "o", "low-pass": "s",
         "low-pass 0.4 mm": "^", "low-pass 0.75 mm": "v", "masked": "D"}  # fmt: skip


def main() -> None:
    """Measure, print, and write JSON and figure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="fewer draws, printed only")
    parser.add_argument("--docs", type=Path, help="folder to write data/ and images/ in")
    parser.add_argument("--only", choices=list(LADDERS), help="one ladder, nothing written")
    options = parser.parse_args()
    rig = small_rig()
    data: dict[str, Any] = {
        **machine(SEED),
        "markers": len(rig.grid),
        "surface_nodes": len(rig.mesh.surface),
        "balanced_operator": balanced_operator(rig.bundle.operator),
    }
    for name, ladder in LADDERS.items():
        if options.only in (None, name):
            data[name] = ladder(rig, options.quick)
            print_rows(name, data[name])
    if options.only or (options.quick and not options.docs):
        return
    docs = options.docs or DOCS
    write_data("force_ladders", data, docs)
    draw(data, docs / "images" / "force_ladders.png")


def balanced_operator(label: str) -> str | None:
    """Which of OPERATORS the bundle's own choice is, by the label of its rung."""
    for name, (rung, parameters) in OPERATORS.items():
        inside = ", ".join(f"{key} {value:g}" for key, value in parameters.items())
        if label == (f"{rung} ({inside})" if inside else rung):
            return name
    return None


def print_rows(name: str, rows: Rows) -> None:
    """One line per rung."""
    print(f"{name}:")
    for row in rows:
        label = "  ".join(str(row[key]) for key in LABELS if key in row)
        values = "  ".join(f"{k} {v:.4g}" for k, v in row.items() if k not in LABELS)
        print(f"  {label:46s} {values}")


def draw(data: dict[str, Any], path: Path) -> None:
    """Four panels, one per ladder from picture to force."""
    from gelslim_core.figure import as_png, new_figure

    figure, axes = new_figure(12.5, 9.0, columns=2, rows=2)
    draw_detection(axes[0][0], data["detection"])
    draw_matching(axes[0][1], data["matching"])
    draw_interpolation(axes[1][0], data["interpolation"])
    draw_operators(axes[1][1], data["operators"])
    for panel in axes.flat:
        panel.grid(alpha=0.3, which="both")
    write_whole(path, as_png(figure))


def draw_detection(panel: Any, rows: Rows) -> None:
    """Error in px against ms; the shape tells the look of the frame."""
    names = list(dict.fromkeys(r["detector"] for r in rows))
    for r in rows:
        colour = COLOURS[names.index(r["detector"])]
        panel.scatter(r["milliseconds"], r["error_px"], marker=MARKS[r["look"]], color=colour)
    for k, name in enumerate(names):
        panel.scatter([], [], marker="o", color=COLOURS[k], label=name)
    for look in LOOKS:
        panel.scatter([], [], marker=MARKS[look], color="#999999", label=look)
    finish(panel, "detection of 342 dots, 640 x 480 px", "error of a centre, px (RMS)")


def draw_matching(panel: Any, rows: Rows) -> None:
    """Wrong markers against displacement; 0 stands at the lower edge."""
    floor = 2e-5
    for k, mode in enumerate(("nearest", "robust")):
        here = [r for r in rows if r["mode"] == mode]
        times = sorted(r["milliseconds"] for r in here)
        label = f"{mode}: {times[0]:.2f} ... {times[-1]:.2f} ms"
        panel.plot(
            [r["peak_pitch"] for r in here],
            [max(r["wrong"], floor) for r in here],
            marker="o",
            color=COLOURS[1 - k],
            label=label,
        )
    panel.axhline(1e-3, color="#999999", lw=1, ls="--")
    panel.set_yscale("log")
    panel.set_xlabel("largest displacement in one shot, pitches")
    panel.set_ylabel("markers matched wrongly (share)")
    panel.set_title(
        f"matching, {MISSING:.0%} missing, {SPURIOUS:.0%} spurious (0 drawn at {floor:g})",
        fontsize=11,
    )
    panel.legend(fontsize=8, frameon=False)


def draw_interpolation(panel: Any, rows: Rows) -> None:
    """Relative error of smooth fields against ms."""
    for k, r in enumerate(rows):
        panel.scatter(
            r["milliseconds"], r["error"], color=COLOURS[k % len(COLOURS)], label=r["interpolation"]
        )
    finish(panel, "interpolation from markers to nodes", "error of smooth bumps (relative L2)")


def draw_operators(panel: Any, rows: Rows) -> None:
    """Error of the force field against ms; the shape tells the method."""
    here = [r for r in rows if r["gel"] == "linear"]
    names = list(dict.fromkeys(r["operator"] for r in here))
    for r in here:
        colour = COLOURS[names.index(r["operator"])]
        panel.scatter(r["milliseconds"], r["error_field"], marker=MARKS[r["method"]], color=colour)
    for k, name in enumerate(names):
        panel.scatter([], [], marker="o", color=COLOURS[k], label=name)
    for method in METHODS:
        panel.scatter([], [], marker=MARKS[method], color="#999999", label=method)
    finish(panel, "operator and method, noisy markers", "error of the force field (relative L2)")


def finish(panel: Any, title: str, label: str) -> None:
    """Logarithmic axes with titles."""
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_xlabel("time per frame, ms (one thread)")
    panel.set_ylabel(label)
    panel.set_title(title, fontsize=11)
    panel.legend(fontsize=7, frameon=False, ncols=2)


if __name__ == "__main__":
    main()
