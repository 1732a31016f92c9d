"""Assembly time and peak memory of the stiffness matrix against peers, in one run.

    python -m bench.stiffness.assembly            # sizes up to 128 x 128 x 8; peers where installed
    python -m bench.stiffness.assembly --write    # docs/data/assembly.json too

The floor is the time to touch fresh memory of the matrix's size for the first time.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bench.bench_data import DOCS, write_data
from bench.rigs.machine import machine

SIZES = ((42, 42, 1), (100, 100, 4), (128, 128, 8))
SIZE_MM = (0.5, 0.5, 0.5)
REPEATS = 15
YOUNGS_MPA, POISSON = 0.147, 0.3223


def ours(cells: tuple[int, int, int]) -> Callable[[], Any]:
    """This project, CSR, element matrix and numbering included."""
    from ifem_export.assembly.assembly import assemble_csr
    from ifem_export.elements.hex8 import hex8_stiffness
    from ifem_export.elements.material import Material

    occupancy = np.ones(cells, dtype=bool)
    gel = Material(YOUNGS_MPA, POISSON, 1000.0)

    def run() -> Any:
        return assemble_csr(occupancy, hex8_stiffness(SIZE_MM, gel, "full"))

    return run


def scikit_fem(cells: tuple[int, int, int]) -> Callable[[], Any]:
    """scikit-fem, mesh and basis prepared."""
    import skfem
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    axes = [np.arange(n + 1) * h for n, h in zip(cells, SIZE_MM, strict=True)]
    mesh = skfem.MeshHex.init_tensor(*axes)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=2)
    form = linear_elasticity(*lame_parameters(YOUNGS_MPA, POISSON))
    return lambda: form.assemble(basis)


def felupe(cells: tuple[int, int, int]) -> Callable[[], Any]:
    """felupe, mesh and region prepared."""
    import felupe as fem

    far = tuple(n * h for n, h in zip(cells, SIZE_MM, strict=True))
    mesh = fem.Cube(b=far, n=tuple(n + 1 for n in cells))
    field = fem.FieldContainer([fem.Field(fem.RegionHexahedron(mesh), dim=3)])
    law = fem.LinearElastic(E=YOUNGS_MPA, nu=POISSON)
    return lambda: fem.SolidBody(law, field).assemble.matrix()


TOOLS = {"gelslim-cad": ours, "felupe": felupe, "scikit-fem": scikit_fem}


def measured(tool: str, cells: tuple[int, int, int], pipe: Any) -> None:
    """Times and memory of one tool in a process of its own."""
    try:
        # Compilers and caches first, on a small pad: their memory is not the matrix's.
        TOOLS[tool]((4, 4, 2))()
        run = TOOLS[tool](cells)
    except ImportError:
        pipe.send(None)
        return
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    matrix = run()
    peak = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
    matrix = matrix.tocsr() if hasattr(matrix, "tocsr") else matrix
    size = matrix.data.nbytes + matrix.indices.nbytes + matrix.indptr.nbytes
    del matrix
    times: list[float] = []
    floors: list[float] = []
    while len(times) < REPEATS and sum(times) < 20.0:
        floors.append(touched(size))
        started = time.perf_counter()
        matrix = run()
        times.append(time.perf_counter() - started)
        del matrix  # giving memory back is in neither time, ours nor the floor's
    pipe.send(
        {
            "seconds": statistics.median(times),
            "peak_bytes": peak,
            "matrix_bytes": size,
            "touch_seconds": statistics.median(floors),
        }
    )


def touched(n_bytes: int) -> float:
    """Time to write fresh memory once, in turn with the tool: both meet the same machine."""
    started = time.perf_counter()
    fresh = np.empty(n_bytes // 8)
    fresh.fill(1.0)
    return time.perf_counter() - started


def main() -> None:
    """Print a table; write it on request."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="the smallest size alone")
    parser.add_argument("--write", action="store_true", help="write docs/data/assembly.json")
    parser.add_argument("--docs", type=Path, help="write data/assembly.json in this folder")
    asked = parser.parse_args()
    context = multiprocessing.get_context("spawn")
    rows: list[dict[str, Any]] = []
    for cells in SIZES[:1] if asked.quick else SIZES:
        base: dict[str, Any] = {}
        for tool in TOOLS:
            ours_end, theirs = context.Pipe(duplex=False)
            process = context.Process(target=measured, args=(tool, cells, theirs))
            process.start()
            theirs.close()
            try:
                found = ours_end.recv()
            except EOFError:
                found = None
            process.join()
            if found is None:
                print(f"{cells}  {tool}: not installed or out of memory")
                continue
            base = base or found
            floor = base["touch_seconds"]
            row = {"cells": cells, "tool": tool, **found}
            rows.append(row)
            print(
                f"{'x'.join(map(str, cells)):11s} {tool:12s} {found['seconds'] * 1e3:10.2f} ms  "
                f"{found['seconds'] / base['seconds']:7.1f} x ours  "
                f"{found['seconds'] / floor:7.1f} x first touch  "
                f"peak {found['peak_bytes'] / base['matrix_bytes']:5.2f} x matrix"
            )
    if asked.write or asked.docs:
        write_data("assembly", {**machine(), "rows": rows}, asked.docs or DOCS)


if __name__ == "__main__":
    main()
