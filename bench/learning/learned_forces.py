"""Contact and normal force by a small network that learnt from pictures of the twin.

    python -m bench.learning.learned_forces            # writes docs/data and a picture
    python -m bench.learning.learned_forces --quick    # with few samples, into out/bench

The work is that of examples/train_regressor.py: training on some built sensors, errors on others.
The data sets stay in out/learned_forces and are made once. Needs scikit-learn.
"""

from __future__ import annotations

import argparse
import io
import runpy
import sys
from pathlib import Path
from typing import Any

import numpy as np

from bench.bench_data import DOCS, ROOT, write_data

EXAMPLE = ROOT / "examples" / "train_regressor.py"
FULL, QUICK = (1600, 300), (120, 30)
FRACTIONS = (16, 4, 1)
"""The smaller training sets are these parts of the largest."""
GEL_MM = 10.0
"""Half of the side of the gel of `mini20`."""


def main() -> None:
    """Train with growing numbers of samples, write the errors and draw the last."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="few samples, into out/bench")
    parser.add_argument("--docs", type=Path, help="folder like docs to write in")
    parser.add_argument("--sets", type=Path, default=ROOT / "out" / "learned_forces")
    asked = parser.parse_args()
    docs = asked.docs or (Path("out/bench") if asked.quick else DOCS)
    train_count, other_count = QUICK if asked.quick else FULL
    folder = asked.sets.with_name(f"{asked.sets.name}_quick") if asked.quick else asked.sets
    sys.argv = [str(EXAMPLE), str(train_count), str(other_count), str(folder.resolve())]
    names = runpy.run_path(str(EXAMPLE))
    rows = [_row(names, train_count // part) for part in FRACTIONS]
    constant = {"samples": 0, **names["constant"]}
    write_data(
        "learned_forces",
        {"other": other_count, "sensors": [4, 3], "modulus": 0.15, "rows": [constant, *rows]},
        docs,
    )
    _draw(names, folder, docs / "images" / "learned_forces.png")


def _row(names: dict[str, Any], count: int) -> dict[str, Any]:
    """Errors of a network that learnt from the first samples."""
    changes, truth = names["train"]
    other_changes, other_truth = names["other"]
    model, scale = names["learned"](changes[:count], truth[:count])
    found = scale.inverse_transform(model.predict(other_changes))
    return {"samples": count, **names["errors"](found, other_truth)}


def table(data: dict[str, Any]) -> str:
    """The errors as a table of Markdown."""
    lines = [
        "| training pictures | place, median (95 %) | normal force, median (95 %) | of the force |",
        "|---:|---:|---:|---:|",
    ]
    for row in data["rows"]:
        name = row["samples"] or "none: always the mean"
        share = 100 * row["force_share"]
        lines.append(
            f"| {name} | {row['place_mm']:.2f} mm ({row['place_95_mm']:.2f} mm) | "
            f"{row['force_n']:.3f} N ({row['force_95_n']:.3f} N) | {share:.0f} % |"
        )
    return "\n".join(lines)


def _draw(names: dict[str, Any], folder: Path, target: Path) -> None:
    from matplotlib.figure import Figure
    from PIL import Image

    found, truth = names["found"], names["other"][1]
    deepest = int(np.argsort(truth[:, 2])[len(truth) // 10])
    others = folder / "out" / "other_sensors"
    files = names["pq"].read_table(others / "index.parquet").to_pylist()
    figure = Figure(figsize=(11, 3.6), layout="constrained")
    picture, place, force = figure.subplots(1, 3, width_ratios=(1.3, 1, 1))
    picture.imshow(Image.open(others / files[deepest]["file"]))
    picture.set(title="a picture that it never saw", xticks=[], yticks=[])
    place.plot(*truth[:, :2].T, ".", color="0.6", label="true")
    for end, start in zip(found, truth, strict=True):
        place.plot([start[0], end[0]], [start[1], end[1]], color="C0", linewidth=0.8)
    place.plot([], [], color="C0", label="error")
    place.set(title="place of the contact", xlabel="x in mm", ylabel="y in mm", aspect="equal")
    place.set(xlim=(-GEL_MM, GEL_MM), ylim=(-GEL_MM, GEL_MM))
    place.legend(loc="upper right", fontsize=8)
    most = 1.05 * float(-truth[:, 2].min())
    force.plot([0, most], [0, most], color="0.6")
    force.plot(-truth[:, 2], -found[:, 2], ".", markersize=3)
    force.set(title="normal force", xlabel="true, N", ylabel="found, N", aspect="equal")
    force.set(xlim=(0, most), ylim=(0, most))
    target.parent.mkdir(parents=True, exist_ok=True)
    with io.BytesIO() as file:
        figure.savefig(file, dpi=100)
        # 256 colours: the sensor's noise does not compress otherwise.
        Image.open(file).convert("RGB").quantize(256).save(target, optimize=True)


if __name__ == "__main__":
    main()
