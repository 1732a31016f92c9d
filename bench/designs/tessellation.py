"""Tessellation: deviation of printed and shown meshes from the exact surface against time.

    python -m bench.designs.tessellation                    # writes docs/data/tessellation.json
    python -m bench.designs.tessellation --quick            # three rungs, prints only
    python -m bench.designs.tessellation --quick --docs D   # and writes D/data/tessellation.json

All parts of designs/gelslim2.yaml that are printed go to STL, the whole finger to GLB, at every
pair of tolerances of `gelslim_cad.export.mesh.RUNGS` and as a build chooses them. Times are
CPU seconds of one thread, for triangulating and for making the files' bytes.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bench.bench_data import DOCS, ROOT, write_data
from bench.models.surface_deviation import deviation_um
from bench.rigs.machine import machine
from gelslim_cad.build.work import VOLUME_TOLERANCE
from gelslim_cad.dimensions import derive
from gelslim_cad.export.glb import ANGULAR_DEG, LINEAR_MM, glb_bytes
from gelslim_cad.export.mesh import RUNGS, face_patches, mesh_for, tessellate, volume_mm3, welded
from gelslim_cad.export.print_files import stl_bytes
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.finger import finger_parts
from gelslim_cad.spec.reader import read_spec

SPEC = ROOT / "designs" / "gelslim2.yaml"
Parts = Sequence[Part]
Tolerances = tuple[float, float]
QUICK = RUNGS[0:5:2]
ENOUGH_S = 3.0


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="three rungs, once each")
    parser.add_argument("--docs", type=Path, help="folder to write data/ in")
    asked = parser.parse_args()
    parts = finger_parts(derive(read_spec(SPEC).spec))
    printed = [p for p in parts if p.process == "print"]
    rungs, repeats = (QUICK, 1) if asked.quick else (RUNGS, 5)
    data: dict[str, Any] = {
        **machine(),
        "design": SPEC.name,
        "printed_parts": len(printed),
        "parts": len(parts),
        "stl": stl_rows(printed, rungs, repeats),
        "glb": glb_rows(parts, rungs, repeats),
    }
    for kind in ("stl", "glb"):
        for row in data[kind]:
            print(
                f"{kind}  {row['rung']:24s} {row['deviation_um']:8.2f} µm  {row['cpu_s']:7.3f} s  "
                f"{row['triangles']:7d} triangles  {row['n_bytes']:9d} bytes"
            )
    if asked.docs or not asked.quick:
        write_data("tessellation", data, asked.docs or DOCS)


def stl_rows(parts: Parts, rungs: Sequence[Tolerances], repeats: int) -> list[dict[str, Any]]:
    """STL of every part at each pair of tolerances, and as a build makes it."""
    rows = []
    for linear, angular in rungs:
        files, cpu_s = timed(partial(stl_files, parts, linear, angular), repeats)
        chosen = [(linear, angular)] * len(parts)
        rows.append(row(named(linear, angular), parts, chosen, cpu_s, files))
    files, cpu_s = timed(partial(built_stl_files, parts), repeats)
    chosen = [mesh_for(p.solid, VOLUME_TOLERANCE)[1] for p in parts]
    return [*rows, row("as built", parts, chosen, cpu_s, files)]


def stl_files(parts: Parts, linear_mm: float, angular_deg: float) -> list[bytes]:
    """All parts at one pair of tolerances."""
    return [stl_bytes(tessellate(p.solid, linear_mm, angular_deg)) for p in parts]


def built_stl_files(parts: Parts) -> list[bytes]:
    """Each part on its own rung: the coarsest that is closed and keeps its volume."""
    return [stl_bytes(mesh_for(p.solid, VOLUME_TOLERANCE)[0]) for p in parts]


def glb_rows(parts: Parts, rungs: Sequence[Tolerances], repeats: int) -> list[dict[str, Any]]:
    """GLB of the whole finger at each pair of tolerances; a build's own is among them.

    A build gives the light guide finer chords.
    """
    own = (LINEAR_MM, ANGULAR_DEG)
    rows = []
    for linear, angular in sorted({*rungs, own}, reverse=True):
        work = partial(glb_bytes, parts, tolerances=(linear, angular))
        data, cpu_s = timed(work, repeats)
        chosen = [(linear, angular)] * len(parts)
        is_own = (linear, angular) == own
        rows.append(
            row(named(linear, angular), parts, chosen, cpu_s, [data]) | {"as_built": is_own}
        )
    return rows


def row(
    name: str, parts: Parts, chosen: Sequence[Tolerances], cpu_s: float, files: Sequence[bytes]
) -> dict[str, Any]:
    """What one rung gives: the worst of all parts."""
    worst, triangles, volume = 0.0, 0, 0.0
    for part, tolerances in zip(parts, chosen, strict=True):
        patches = face_patches(part.solid, *tolerances)
        worst = max(worst, deviation_um(part.solid, patches))
        triangles += sum(len(p.triangles) for p in patches)
        exact = float(part.solid.Volume())
        volume = max(volume, abs(volume_mm3(welded(patches)) / exact - 1))
    return {
        "rung": name,
        "deviation_um": worst,
        "volume_error": volume,
        "cpu_s": cpu_s,
        "triangles": triangles,
        "n_bytes": sum(map(len, files)),
        "finest": min(chosen),
    }


def named(linear_mm: float, angular_deg: float) -> str:
    """A pair of tolerances as text."""
    return f"{1000 * linear_mm:g} µm, {angular_deg:g}°"


def timed(work: Callable[[], Any], repeats: int) -> tuple[Any, float]:
    """Last result and median CPU seconds; one call before, for imports."""
    result, times = work(), list[float]()
    while len(times) < repeats and sum(times) < ENOUGH_S:
        started = time.process_time()
        result = work()
        times.append(time.process_time() - started)
    return result, float(np.round(statistics.median(times), 6))


if __name__ == "__main__":
    main()
