"""Twin: cost and worth of every effect on the gallery, and the contact's tolerance ladder.

python bench/twin_ladders.py            # writes docs/data
python bench/twin_ladders.py --quick    # two scenes without large strain, prints only
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from bench_data import DOCS, write_data
from machine import machine
from twin_effects import Bench, measured

from gelslim_cad.cli.twin_sensor import spec_sensor
from gelslim_twin.contact.compliance import SurfaceCompliance
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.contact.tool import Tool
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.simulation.stored_sensor import store_sensor, stored_sensor

ROOT = Path(__file__).parents[1]
TOLERANCES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
FINEST = 1e-7
MOST_POSES = 8
QUICK = ("press_sphere", "release")


def main() -> None:
    """Measure, print, write JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--docs", type=Path, help="folder to write data/ in")
    asked = parser.parse_args()
    quick = asked.quick
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        store_sensor(spec_sensor(ROOT / "designs" / "gelslim2.yaml"), folder, True)
        sensor, rows = stored_sensor(folder), []
        for path in sorted((ROOT / "designs" / "scenes").glob("*.yaml")):
            if quick and path.stem not in QUICK:
                continue
            bench = Bench(read_scene(path), sensor, folder, MOST_POSES)
            rows += measured(bench, quick)
        for r in rows:
            errors = ", ".join(f"{k} {v:.3g} <= {r['bound'][k]:.3g}" for k, v in r["error"].items())
            print(
                f"{r['scene']:15s} {r['effect']:15s} {r['ms_with']:8.2f} {r['ms_without']:8.2f} ms"
                f"  {errors}{'  BOUND TOO SMALL: ' + str(r['short']) if r['short'] else ''}"
            )
        contact = [r for mu in (0.0, 0.6) for r in ladder(sensor, folder, mu)]
        for r in contact:
            print(r)
    if asked.docs or not quick:
        about = {**machine(), "seed": "of each scene", "poses_at_most": MOST_POSES}
        data = {**about, "effects": rows, "contact": contact}
        write_data("twin_ladders", data, asked.docs or DOCS)


def ladder(sensor: Any, folder: Path, friction: float) -> list[dict[str, Any]]:
    """Error against the finest tolerance, and time, along shear_sphere."""
    loaded = read_scene(ROOT / "designs" / "scenes" / "shear_sphere.yaml")
    tool = Tool.of(loaded.scene.indenters, loaded.folder, loaded.scene.seed)
    compliance = SurfaceCompliance(sensor.bundle, folder)

    def solved(tolerance: float) -> tuple[Any, float]:
        solver = ContactSolver(compliance, tool, ContactSettings(tolerance, friction))
        started = time.perf_counter()
        force = list(solver.states(loaded.poses))[-1].force_n
        return force, 1000 * (time.perf_counter() - started) / len(loaded.poses)

    true, _ = solved(FINEST)
    rows = []
    for tolerance in TOLERANCES:
        force, ms = solved(tolerance)
        whole = float(np.linalg.norm((force - true).sum(axis=0)))
        field = float(np.linalg.norm(force - true) / np.linalg.norm(true))
        rows.append(
            {"friction": friction, "tolerance": tolerance, "ms": ms,
             "resultant_error_n": whole, "field_error": field}
        )  # fmt: skip
    return rows


if __name__ == "__main__":
    main()
