"""Time to derive and check many designs at once.

python bench/design_batch.py --count 10000
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from gelslim_cad.checks import check_batch
from gelslim_cad.dimensions import derive_batch
from gelslim_cad.spec.reader import read_spec

SPEC = Path(__file__).parents[1] / "designs" / "mini20.yaml"
SPANS = {
    "design.gel.length_mm": (12.0, 30.0),
    "design.gel.width_mm": (12.0, 30.0),
    "design.gel.thickness_mm": (1.5, 4.0),
    "camera.f_number": (2.0, 8.0),
}


def main() -> None:
    """Print wall and CPU seconds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    count = parser.parse_args().count
    seed = parser.parse_args().seed
    spec = read_spec(SPEC).spec
    rng = np.random.default_rng(seed)
    designs = {path: rng.uniform(*span, count) for path, span in SPANS.items()}
    derive_batch(spec, {path: values[:256] for path, values in designs.items()})
    cpu, wall = time.process_time(), time.perf_counter()
    d = derive_batch(spec, designs)
    derived = time.perf_counter() - wall
    failed = np.any(list(check_batch(d).values()), axis=0)
    total = time.perf_counter() - wall
    print(f"{count} designs: derived in {derived:.1f} s, with rules {total:.1f} s")
    print(f"CPU {time.process_time() - cpu:.1f} s; {np.mean(~failed):.0%} keep every rule")


if __name__ == "__main__":
    main()
