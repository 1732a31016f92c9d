"""How accurate are forces from compressed pictures? By format, quality and resolution of colours.

    python -m bench.force.compressed_pictures                     # 30 presses of each compression
    python -m bench.force.compressed_pictures --kept out/presses  # folder that keeps the presses

Writes docs/data/compressed_pictures.json. Nothing is given of the object. The presses are those of
tests/force/sigma_cases.py, and the pipelines those of tests/force/compressed_gate.py.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bench.bench_data import DOCS, see_tests, write_data
from bench.rigs.force_scores import recorded
from bench.rigs.machine import machine

Record = Mapping[str, Any]
KEPT = Path("out") / "compressed_pictures"


def main() -> None:
    """Score the presses and write the rows."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", type=int, default=30, help="presses of each compression")
    parser.add_argument("--kept", type=Path, default=KEPT, help="folder for the presses")
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder like docs")
    options = parser.parse_args()
    options.kept.mkdir(parents=True, exist_ok=True)
    record = {**machine(31), "cases": options.cases, "rows": scored(options.cases, options.kept)}
    write_data("compressed_pictures", record, options.docs)
    print(table(record))


def scored(count: int, kept: Path) -> dict[str, dict[str, Any]]:
    """Errors and deviations by compression, where the picture without contact has it and where not.

    Args:
        count: Number of presses.
        kept: Folder that keeps them.
    """
    see_tests("force")
    from compressed_gate import COMPRESSIONS, NONE, scores

    rows: dict[str, dict[str, Any]] = {}
    for by in COMPRESSIONS:
        both = {"all": scores(by, by, range(count), kept)}
        if by != NONE:
            both["frames"] = scores(by, NONE, range(count), kept)
        rows[by.name] = {
            key: recorded(map(vars, some), ("true", "error", "sigma")) for key, some in both.items()
        }
        print(by.name, flush=True)
    return rows


def table(record: Record) -> str:
    """The rows as a Markdown table, with what they stand for."""
    lines = [
        f"{record['cases']} presses of each; three numbers are those of F_x, F_y and F_z. In the "
        "last three columns only the frames are compressed, not the picture without contact.",
        "",
        "| compression | F_z unknown | median, largest \\|error\\| of F_z | median σ of F_z | "
        "RMS of error/σ | frames alone: F_z unknown | \\|error\\| of F_z | RMS of error/σ |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for name, row in record["rows"].items():
        refused, error, sigma, rms = _cells(row["all"])
        cells = [name, refused, error, sigma, rms, "", "", ""]
        if "frames" in row:
            cells[5], cells[6], _, cells[7] = _cells(row["frames"])
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _cells(row: Record) -> tuple[str, str, str, str]:
    """Number without a force, errors and deviation of F_z, and scores."""
    if not row["error_mn"]:
        return f"{row['refused']}", "–", "–", "–"
    true, error, sigma = (np.array(row[k]) for k in ("true_mn", "error_mn", "sigma_mn"))
    size = np.abs(error[:, 2] / true[:, 2])
    rms = np.sqrt(np.square(error / sigma).mean(axis=0))
    return (
        f"{row['refused']}",
        f"{100 * np.median(size):.1f}, {100 * size.max():.0f} %",
        f"{100 * np.median(sigma[:, 2] / np.abs(true[:, 2])):.1f} %",
        ", ".join(f"{v:.2f}" for v in rms),
    )


if __name__ == "__main__":
    main()
