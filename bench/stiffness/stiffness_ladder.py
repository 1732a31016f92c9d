"""Error of the force field against time: layers, element, pitch x operator x Poisson's ratio.

    python -m bench.stiffness.stiffness_ladder            # writes docs/data and docs/images
    python -m bench.stiffness.stiffness_ladder --quick    # one Poisson's ratio, few layers, prints

The reference of every point is the same pad at half its pitch with eight B-bar layers (see
ifem_export.operators.ladder). One of layers, element and pitch is varied at a time.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from bench.bench_data import DOCS, write_data, write_whole
from bench.rigs.machine import machine
from ifem_export.elements.hex8 import Formulation
from ifem_export.elements.material import Material
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh
from ifem_export.operators.ladder import FIELD_SEED, measure_ladder

RATIOS = (0.3223, 0.45, 0.49)
LAYERS = (1, 2, 3, 4, 6, 8)
QUICK_LAYERS = (1, 2, 4)
ELEMENTS: tuple[Formulation, ...] = ("full", "incompatible")
ACROSS = (28, 56)
CELLS, SIDE_MM, THICKNESS_MM, CORNER_MM = 42, 28.0, 2.0, 1.0
DEFAULT_LAYERS = 4
VARIANTS = {
    "bbar, 28² cells": "#7fb0e0",
    "bbar, 42² cells": "#1f4e8c",
    "bbar, 56² cells": "#0b1e3d",
    "full": "#c4580a",
    "incompatible": "#2d8a57",
}
MARKS = {"paper": "*", "one layer": "P", "truncated": "v", "fft": "s", "pcg": "o", "factor": "D"}
COLOURS = {1: "#888888", 2: "#c4580a", 3: "#b59b00", 4: "#1f4e8c", 6: "#2d8a57", 8: "#7a3f8f"}


def main() -> None:
    """Measure, print, and write JSON and figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--docs", type=Path, help="folder to write data/ and images/ in")
    asked = parser.parse_args()
    quick = asked.quick
    rows: list[dict[str, Any]] = []
    for ratio in RATIOS[:1] if quick else RATIOS:
        for layers in QUICK_LAYERS if quick else LAYERS:
            rows += measured(ratio, layers)
        for element in ELEMENTS:
            rows += measured(ratio, 4, element)
        for across in ACROSS[:1] if quick else ACROSS:
            rows += measured(ratio, 4, across=across)
    for r in rows:
        print(
            f"nu {r['poissons_ratio']:g}  {r['cells']}²x{r['layers']} {r['element']:12s} "
            f"{r['label']:22s} "
            f"{r['error_field']:8.2%}  {r['milliseconds']:7.3f} ms"
        )
    if quick and not asked.docs:
        return
    docs = asked.docs or DOCS
    data = {
        **machine(FIELD_SEED),
        "pad": f"{SIDE_MM:g} x {SIDE_MM:g} mm, {THICKNESS_MM:g} mm thick",
        "rows": rows,
    }
    write_data("stiffness_ladder", data, docs)
    draw(rows, docs / "images" / "stiffness_ladder.png")


def measured(
    ratio: float, layers: int, element: Formulation = "bbar", across: int = CELLS
) -> list[dict[str, Any]]:
    """Rungs of one pad; a pad of one layer has only itself."""
    outline = RoundedRectangle(SIDE_MM, SIDE_MM, CORNER_MM)
    mesh, _ = build_pad_mesh(outline, THICKNESS_MM, cells=(across, across, layers))
    ladder = measure_ladder(mesh, Material(0.147, ratio, 1020.0), element)
    rungs = ladder.rungs if layers > 1 else ladder.rungs[-1:]
    return [
        {
            "poissons_ratio": ratio,
            "cells": across,
            "layers": layers,
            "element": element,
            "rung": r.rung if layers > 1 else "one layer",
            "label": r.label if layers > 1 else "one layer",
            "error_field": r.error_field,
            "error_resultant": r.error_resultant,
            "milliseconds": r.milliseconds,
            "n_bytes": r.n_bytes,
        }
        for r in rungs
    ]


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    """Above: layers and operators with the Pareto front; below: elements and pitches."""
    from gelslim_core.figure import as_png, new_figure

    ratios = sorted({r["poissons_ratio"] for r in rows})
    figure, axes = new_figure(12.0, 7.6, columns=max(2, len(ratios)), rows=2)
    for k, ratio in enumerate(ratios):
        here = [r for r in rows if r["poissons_ratio"] == ratio]
        plain = [r for r in here if r["element"] == "bbar" and r["cells"] == CELLS]
        above, below = axes[0][k], axes[1][k]
        for r in plain:
            if r["rung"] == "paper" and r["layers"] != DEFAULT_LAYERS:
                continue
            above.scatter(*spot(r), **look(r), color=shade(r), zorder=3)
        front = pareto(plain)
        above.plot(*zip(*front, strict=True), color="#999999", lw=1, zorder=1)
        above.set_title(f"ν = {ratio:g}", fontsize=11)
        for r in here:
            name = variant(r)
            if name is None or r["rung"] not in ("factor", "fft", "pcg"):
                continue
            below.scatter(*spot(r), **look(r), color=VARIANTS[name], zorder=3)
        for panel in (above, below):
            panel.set_xscale("log")
            panel.set_yscale("log")
            panel.grid(alpha=0.3, which="both")
        below.set_xlabel("time per frame, ms (one thread)")
    for row in axes:
        row[0].set_ylabel("error of the force field (relative L2)")
    for rung, mark in MARKS.items():
        axes[0][-1].scatter([], [], marker=mark, color="#555555", label=rung)
    for layers, colour in COLOURS.items():
        axes[0][-1].scatter([], [], marker="o", color=colour, label=f"{layers} layers")
    for name, colour in VARIANTS.items():
        axes[1][-1].scatter([], [], marker="o", color=colour, label=name)
    for row in axes:
        row[-1].legend(fontsize=8, frameon=False, ncols=2)
    write_whole(path, as_png(figure))


def spot(row: dict[str, Any]) -> tuple[float, float]:
    """Place of a rung in the figure."""
    return row["milliseconds"], row["error_field"]


def look(row: dict[str, Any]) -> dict[str, Any]:
    """Marker of a rung; the paper's is large."""
    return {"marker": MARKS[row["rung"]], "s": 120 if row["rung"] == "paper" else 36}


def shade(row: dict[str, Any]) -> str:
    """Colour of a pad by its layers."""
    return "black" if row["rung"] == "paper" else COLOURS[row["layers"]]


def variant(row: dict[str, Any]) -> str | None:
    """Which of the lower panels' pads a row belongs to."""
    if row["layers"] != DEFAULT_LAYERS:
        return None
    if row["element"] != "bbar":
        return str(row["element"])
    return f"bbar, {row['cells']}² cells"


def pareto(rows: list[dict[str, Any]]) -> list[tuple[float, float]]:
    """(time, error) of the rungs that no other beats in both."""
    front: list[tuple[float, float]] = []
    for r in sorted(rows, key=lambda r: r["milliseconds"]):
        if not front or r["error_field"] < front[-1][1]:
            front.append((r["milliseconds"], r["error_field"]))
    return front


if __name__ == "__main__":
    main()
