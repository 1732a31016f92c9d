"""Error of the force field against time: layers x operator x Poisson's ratio.

    python bench/stiffness_ladder.py            # writes docs/data and docs/images
    python bench/stiffness_ladder.py --quick    # one Poisson's ratio, prints only

The reference of every point is the same pad at half the pitch with eight layers (see
ifem_export.ladder).
"""

from __future__ import annotations

import argparse
import json
import platform
from pathlib import Path
from typing import Any

from ifem_export.ladder import measure_ladder
from ifem_export.material import Material
from ifem_export.outline import RoundedRectangle
from ifem_export.pad_mesh import build_pad_mesh

ROOT = Path(__file__).parents[1]
RATIOS = (0.3223, 0.45, 0.49)
LAYERS = (2, 3, 4, 6)
CELLS, SIDE_MM, THICKNESS_MM, CORNER_MM = 42, 28.0, 2.0, 1.0
MARKS = {"paper": "*", "truncated": "v", "fft": "s", "pcg": "o", "factor": "D"}
COLOURS = {2: "#c4580a", 3: "#b59b00", 4: "#1f4e8c", 6: "#2d8a57"}


def main() -> None:
    """Measure, print, and write JSON and figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    quick = parser.parse_args().quick
    rows: list[dict[str, Any]] = []
    for ratio in RATIOS[:1] if quick else RATIOS:
        for layers in LAYERS:
            rows += measured(ratio, layers)
    for r in rows:
        print(
            f"nu {r['poissons_ratio']:g}  {r['layers']} layers  {r['label']:22s} "
            f"{r['error_field']:8.2%}  {r['milliseconds']:7.3f} ms"
        )
    if quick:
        return
    data = {
        "pad": f"{CELLS} x {CELLS} cells over {SIDE_MM:g} mm, {THICKNESS_MM:g} mm thick, bbar",
        "machine": f"{platform.machine()}, {platform.system()}, Python {platform.python_version()}",
        "rows": rows,
    }
    target = ROOT / "docs" / "data" / "stiffness_ladder.json"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    draw(rows, ROOT / "docs" / "images" / "stiffness_ladder.png")


def measured(ratio: float, layers: int) -> list[dict[str, Any]]:
    """Rungs of one pad."""
    outline = RoundedRectangle(SIDE_MM, SIDE_MM, CORNER_MM)
    mesh, _ = build_pad_mesh(outline, THICKNESS_MM, cells=(CELLS, CELLS, layers))
    ladder = measure_ladder(mesh, Material(0.147, ratio, 1020.0), "bbar")
    return [
        {
            "poissons_ratio": ratio,
            "layers": layers,
            "rung": r.rung,
            "label": r.label,
            "error_field": r.error_field,
            "error_resultant": r.error_resultant,
            "milliseconds": r.milliseconds,
            "n_bytes": r.n_bytes,
        }
        for r in ladder.rungs
    ]


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    """One panel per Poisson's ratio, the Pareto front drawn."""
    from gelslim_cad.figure import as_png, new_figure

    figure, axes = new_figure(12.0, 4.2, columns=len(RATIOS))
    for panel, ratio in zip(axes, RATIOS, strict=True):
        here = [r for r in rows if r["poissons_ratio"] == ratio]
        for r in here:
            if r["rung"] == "paper" and r["layers"] != LAYERS[0]:
                continue
            colour = "black" if r["rung"] == "paper" else COLOURS[r["layers"]]
            size = 120 if r["rung"] == "paper" else 36
            spot = r["milliseconds"], r["error_field"]
            panel.scatter(*spot, marker=MARKS[r["rung"]], color=colour, s=size, zorder=3)
        front = pareto(here)
        panel.plot(*zip(*front, strict=True), color="#999999", lw=1, zorder=1)
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.set_xlabel("time per frame, ms (one thread)")
        panel.set_title(f"ν = {ratio:g}", fontsize=11)
        panel.grid(alpha=0.3, which="both")
    axes[0].set_ylabel("error of the force field (relative L2)")
    for rung, mark in MARKS.items():
        axes[-1].scatter([], [], marker=mark, color="#555555", label=rung)
    for layers, colour in COLOURS.items():
        axes[-1].scatter([], [], marker="o", color=colour, label=f"{layers} layers")
    axes[-1].legend(fontsize=8, frameon=False, ncols=2)
    path.write_bytes(as_png(figure))


def pareto(rows: list[dict[str, Any]]) -> list[tuple[float, float]]:
    """(time, error) of the rungs that no other beats in both."""
    front: list[tuple[float, float]] = []
    for r in sorted(rows, key=lambda r: r["milliseconds"]):
        if not front or r["error_field"] < front[-1][1]:
            front.append((r["milliseconds"], r["error_field"]))
    return front


if __name__ == "__main__":
    main()
