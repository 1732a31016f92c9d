"""Contact on ever finer pads: by the table of columns while it fits, and by convolution.

    python -m bench.twin.twin_fine            # writes docs/data/twin_fine.json
    python -m bench.twin.twin_fine --quick    # coarser pads, printed only

A ball is pressed into the gel of designs/gelslim2.yaml, 28 x 28 x 2 mm in ten layers. Each row is a
process of its own. Times are of the processor (user and system), on one thread; memory is the
largest of the process, libraries included.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from bench.bench_data import DOCS, write_data
from bench.rigs.machine import machine
from gelslim_twin.contact.fine_contact import FineContact
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.compliance.convolved import ConvolvedCompliance
from ifem_export.elements.material import Material
from ifem_export.mesh.pad_mesh import PadMesh

SIDE_MM, THICK_MM, LAYERS = 28.0, 2.0, 10
BALL, DEPTH_MM, FRICTION = Sphere(shape="sphere", radius_mm=10.0), 0.3, 0.5
CELLS, QUICK, MOST_IN_TABLE = (35, 50, 70, 100, 140, 200, 280), (20, 35), 50
LARGE = 5000
"""Surface nodes from which the growth of the time is fitted."""
WAYS = ("table", "convolution")


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="coarser pads, printed only")
    parser.add_argument("--docs", type=Path, help="folder like docs to write in")
    parser.add_argument("--row", nargs=3, metavar=("WAY", "CELLS", "FORCES"), help="one row")
    asked = parser.parse_args()
    if asked.row:
        way, cells, forces = asked.row
        with threadpool_limits(limits=1):
            print(json.dumps(measured(way, int(cells), Path(forces))))
        return
    data = {**machine(), "layers": LAYERS, "rows": rows(QUICK if asked.quick else CELLS)}
    print(table(data))
    if not asked.quick or asked.docs:
        write_data("twin_fine", data, asked.docs or DOCS)


def rows(every: Sequence[int]) -> list[dict[str, Any]]:
    """A row per pad, each way in a process of its own."""
    found = []
    for cells in every:
        row: dict[str, Any] = {"cells": cells, "nodes": (cells + 1) ** 2}
        with tempfile.TemporaryDirectory() as place:
            forces = {way: Path(place) / f"{way}.npy" for way in WAYS}
            for way in WAYS[0 if cells <= MOST_IN_TABLE else 1 :]:
                asked = (way, str(cells), str(forces[way]))
                call = [sys.executable, "-m", "bench.twin.twin_fine", "--row", *asked]
                row[way] = json.loads(subprocess.run(call, capture_output=True, check=True).stdout)
            if "table" in row:
                one, other = (np.load(forces[way]) for way in WAYS)
                row["apart"] = float(np.linalg.norm(one - other) / np.linalg.norm(one))
        found.append(row)
    return found


def pad(cells: int) -> Bundle:
    """The gel in `cells` x `cells` x `LAYERS` cells."""
    pitch, height = SIDE_MM / cells, THICK_MM / LAYERS
    mesh = PadMesh.from_occupancy(
        np.ones((cells, cells, LAYERS), dtype=bool),
        (pitch, pitch, height),
        (-SIDE_MM / 2, -SIDE_MM / 2, -THICK_MM),
    )
    return build_bundle(mesh, Material(0.147, 0.3223, 1000.0), "bbar", with_stiffness=False)


def measured(way: str, cells: int, forces: Path) -> dict[str, float]:
    """Time of the first pose, of the one after, and memory."""
    bundle = pad(cells)
    tool, settings = Tool.of([BALL], Path()), ContactSettings(1e-3, FRICTION)
    contact = (
        ContactSolver(SurfaceCompliance(bundle), tool, settings)
        if way == "table"
        else FineContact(ConvolvedCompliance(bundle), tool, settings)
    )
    # On a small pad all functions are compiled or read.
    small = pad(8)
    warm = (
        ContactSolver(SurfaceCompliance(small), tool, settings)
        if way == "table"
        else FineContact(ConvolvedCompliance(small), tool, settings)
    )
    list(warm.states((Pose(depth_mm=DEPTH_MM),)))
    begun = time.process_time()
    states = contact.states((Pose(depth_mm=DEPTH_MM / 2), Pose(time_s=1.0, depth_mm=DEPTH_MM)))
    next(states)
    middle = time.process_time()
    last = next(states)
    np.save(forces, last.force_n)
    return {
        "first_s": middle - begun,
        "next_s": time.process_time() - middle,
        "touched": int((last.touch > 0).sum()),
        "memory_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
    }


def growth(data: Mapping[str, Any]) -> float:
    """Exponent of the time of a pose by convolution against n log n, over the large pads."""
    large = [row for row in data["rows"] if row["nodes"] >= LARGE] or data["rows"]
    nodes = np.array([row["nodes"] for row in large], dtype=float)
    times = np.array([row["convolution"]["next_s"] for row in large])
    return float(np.polyfit(np.log(nodes * np.log(nodes)), np.log(times), 1)[0])


def table(data: Mapping[str, Any]) -> str:
    """The table of docs/digital_twin.md."""
    lines = [
        "| pitch, mm | surface nodes | in contact | table: first pose, s | next, s | GB "
        "| convolution: first pose, s | next, s | GB | fields apart |",
        "|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for row in data["rows"]:
        cells = [f"{SIDE_MM / row['cells']:.2g}", f"{row['nodes']}"]
        cells.append(f"{row['convolution']['touched']}")
        for way in WAYS:
            one = row.get(way)
            cells += (
                [f"{one['first_s']:.2g}", f"{one['next_s']:.2g}", f"{one['memory_gb']:.2g}"]
                if one
                else ["", "", ""]
            )
        cells.append(f"{row['apart']:.1e}" if "apart" in row else "")
        lines.append(f"| {' | '.join(cells)} |")
    lines += [
        "",
        f"From {LARGE} nodes on the time of a pose by convolution grows as (n log n) to the power "
        f"of {growth(data):.2f}. Times are CPU times of one thread of {data['processor']}.",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
