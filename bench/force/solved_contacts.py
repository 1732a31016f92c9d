"""Solve the deep contacts of the tests: rigid shapes on a neo-Hookean gel, on a finer mesh.

    python -m bench.force.solved_contacts          # all, 15 minutes; keeps what is solved

Writes tests/force/deep_contacts.npz. Solved contacts are kept in a folder, so that a run that was
stopped goes on where it ended.
"""

from __future__ import annotations

import argparse
import io
from pathlib import Path

import numpy as np

from bench.bench_data import see_tests, write_whole

KEPT = Path("out") / "deep_contacts"


def main() -> None:
    """Solve what is not kept, and write the file."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kept", type=Path, default=KEPT, help="folder for solved contacts")
    options = parser.parse_args()
    see_tests("force")
    from deep_contacts import COUNT, STORED, DeepContact, deep_case, pack, solve

    options.kept.mkdir(parents=True, exist_ok=True)
    contacts = []
    for seed in range(COUNT):
        path = options.kept / f"{seed}.npz"
        if not path.exists():
            found = solve(deep_case(seed))
            np.savez_compressed(path, moved=found.moved_mm, force=found.force_n)
            print(seed, found.case.kind, found.force_n.sum(axis=0).round(3), flush=True)
        with np.load(path) as kept:
            contacts.append(DeepContact(deep_case(seed), kept["moved"], kept["force"]))
    stream = io.BytesIO()
    np.savez_compressed(stream, **pack(contacts))
    write_whole(STORED, stream.getvalue())


if __name__ == "__main__":
    main()
