"""Designs a second of `derive_batch` and of the rules, by number of threads.

    python -m bench.designs.design_batch [--count 10000] [--jobs 1 2] [--repeats 3]

Times are medians over the repeats, after the compiled search is loaded; the CPU time is that of
the whole process, all threads.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from bench.bench_data import ROOT
from gelslim_cad.checks import margins_batch
from gelslim_cad.dimensions import derive, derive_batch
from gelslim_cad.spec.reader import read_spec

SPEC = ROOT / "designs" / "mini20.yaml"
SPANS = {
    "design.gel.length_mm": (12.0, 30.0),
    "design.gel.width_mm": (12.0, 30.0),
    "design.gel.thickness_mm": (1.5, 4.0),
    "camera.f_number": (2.0, 8.0),
}
WARM_UP = 256


def timed(work: Callable[[], Any], repeats: int) -> tuple[Any, float, float]:
    """The last result, median wall seconds and median CPU seconds."""
    walls, cpus, result = [], [], None
    for _ in range(repeats):
        cpu, wall = time.process_time(), time.perf_counter()
        result = work()
        walls.append(time.perf_counter() - wall)
        cpus.append(time.process_time() - cpu)
    return result, statistics.median(walls), statistics.median(cpus)


def main() -> None:
    """Print designs a second, wall and CPU seconds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--jobs", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    spec = read_spec(SPEC).spec
    rng = np.random.default_rng(asked.seed)
    designs = {path: rng.uniform(*span, asked.count) for path, span in SPANS.items()}
    warm = {path: rng.uniform(*span, WARM_UP) for path, span in SPANS.items()}
    derive_batch(spec, warm)

    derive(spec)
    _, wall, cpu = timed(partial(derive, spec), 5)
    print(f"one design: {wall * 1e3:.0f} ms, CPU {cpu * 1e3:.0f} ms")
    for jobs in asked.jobs:
        batch, wall, cpu = timed(partial(derive_batch, spec, designs, jobs=jobs), asked.repeats)
        rate = asked.count / wall
        print(f"jobs {jobs}: {rate:.0f} designs/s; {asked.count} in {wall:.1f} s, CPU {cpu:.1f} s")
    margins, wall, cpu = timed(partial(margins_batch, batch), asked.repeats)
    kept = np.mean(np.all([room >= 0 for room in margins.values()], axis=0))
    print(f"rules: {wall:.1f} s, CPU {cpu:.1f} s; {kept:.0%} keep every one")


if __name__ == "__main__":
    main()
