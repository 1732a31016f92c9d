"""Forces of objects of which nothing is known, on the designs that come with the program.

    python -m bench.force.shipped_designs                # 40 presses a design and light
    python -m bench.force.shipped_designs --presses 8    # fewer
    python -m bench.force.shipped_designs --docs DIR     # writes DIR/data, not docs/data

Truth and pictures are those of `tests/force/designed_presses.py`: a pad of half the pitch, light
from traced directions at each place, with LEDs in place or off it. Set OMP_NUM_THREADS=1.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from bench.bench_data import DOCS, see_tests, write_data
from bench.rigs.machine import machine

NAMES = ("gelslim2", "mini20", "thin", "wide", "gelslim3_lens", "long50")


def main() -> None:
    """Score all designs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--presses", type=int, default=40)
    parser.add_argument("--docs", type=Path, default=DOCS)
    options = parser.parse_args()
    rows = []
    for name in NAMES:
        for in_place in (True, False):
            rows.append(row_of(name, in_place, options.presses))
            print(line(rows[-1]), flush=True)
    data = {"machine": machine(), "presses": options.presses, "rows": rows}
    print(f"wrote {write_data('shipped_designs', data, options.docs)}")


def row_of(name: str, in_place: bool, presses: int) -> dict[str, Any]:
    """Errors on one design, with its LEDs in place or not."""
    see_tests("force")
    from designed_presses import DESIGNS, DesignedSensor

    sensor = DesignedSensor(DESIGNS / f"{name}.yaml", in_place)
    found, cell = sensor.scores(presses), sensor.bundle.mesh.cell_size_mm[0]
    size = np.abs(found.normal)
    return {
        "design": name,
        "in_place": in_place,
        "markers": len(sensor.renderer.grid.positions_mm),
        "cell_mm": float(cell),
        "given": len(size),
        "normal": float(np.median(size)),
        "normal_95": float(np.percentile(size, 95)),
        "mean": float(found.normal.mean()),
        "mean_error": float(found.normal.std(ddof=1) / np.sqrt(len(size))),
        "shear": float(np.median(found.shear)),
        "rms": np.sqrt((found.score**2).mean(axis=0)).tolist(),
    }


def line(row: dict[str, Any]) -> str:
    """A line of the table."""
    rms = ", ".join(f"{value:.2f}" for value in row["rms"])
    leds = "in place" if row["in_place"] else "off it"
    return (
        f"| `{row['design']}` | {row['markers']} | {row['cell_mm']:.2f} mm | {leds} "
        f"| {row['given']} | {row['normal']:.1%} | {row['normal_95']:.0%} "
        f"| {row['mean']:+.1%} ± {row['mean_error']:.1%} | {row['shear']:.1%} | {rms} |"
    ).replace("%", " %")


def table(data: dict[str, Any]) -> str:
    """The table of the docs."""
    head = (
        "| design | markers | cells | LEDs | given | error of F_z: median | 95 % | mean | shear "
        "| RMS of error / σ: F_x, F_y, F_z |\n|---|---:|---:|---|---:|---:|---:|---:|---:|---:|"
    )
    return "\n".join([head, *(line(row) for row in data["rows"])])


if __name__ == "__main__":
    main()
