"""Yields of the example designs, what limits them, and what 95 % would cost.

python -m bench.designs.tolerance_yields    # under a minute; writes docs/data/tolerance_yields.json
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

from bench.bench_data import DOCS, write_data
from bench.rigs.machine import machine
from gelslim_cad.dimensions import derive
from gelslim_cad.spec.reader import read_spec
from gelslim_cad.tolerance.study import study_record, tolerance_study
from gelslim_cad.tolerance.yields import sampled

SEED = 0


def measured(path: Path, samples: int) -> dict[str, Any]:
    """Return the figures of one design that the page shows."""
    spec = read_spec(path).spec
    record = study_record(tolerance_study(spec, samples=samples, seed=SEED))
    d = derive(spec)
    start = time.perf_counter()
    sampled(d, 10_000, SEED)
    seconds = time.perf_counter() - start
    worst = next(v for v in record["variance"] if v["place"].startswith(record["worst_rule"]))
    return {
        "name": record["name"],
        "yields": {stage: found["all"] for stage, found in record["yields"].items()},
        "worst_rule": record["worst_rule"],
        "worst_cause": max(worst["total"], key=lambda g: worst["total"][g]),
        "worst_share": max(worst["total"].values()),
        "plan": record["plan"],
        "forces": record["forces"],
        "seconds_per_10000": round(seconds, 3),
    }


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder with data/")
    parser.add_argument("--samples", type=int, default=10_000, help="fingers per design")
    given = parser.parse_args()
    designs = sorted((DOCS.parent / "designs").glob("*.yaml"))
    rows = [measured(path, given.samples) for path in designs]
    record = {**machine(SEED), "samples": given.samples, "designs": rows}
    print(write_data("tolerance_yields", record, given.docs))


if __name__ == "__main__":
    main()
