"""`gelslim validate` on the design, kept for the guide's table.

    python bench/twin_validation.py    # some minutes; writes docs/data and the guide's table

The record is the command's own (`--json`), without its single frames.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from bench_data import write_data
from machine import machine
from twin_tables import main as write_tables

ROOT = Path(__file__).parents[1]
SPEC = "designs/gelslim2.yaml"
LEFT_OUT = ("frames",)


def main() -> None:
    """Run, keep, write the table."""
    started = time.perf_counter()
    record = validated()
    seconds = time.perf_counter() - started
    kept = {k: v for k, v in record.items() if k not in LEFT_OUT}
    write_data("twin_validation", {**machine(0), "design": SPEC, "seconds": round(seconds), **kept})
    write_tables()


def validated() -> dict[str, Any]:
    """The command's record, from a process of its own. Raises CalledProcessError."""
    with tempfile.TemporaryDirectory() as place:
        command = [sys.executable, "-m", "gelslim_cad", "validate", SPEC, "-o", place]
        done = subprocess.run(
            [*command, "--no-pictures", "--json"], cwd=ROOT, check=True, stdout=subprocess.PIPE
        )
    found: dict[str, Any] = json.loads(done.stdout)
    return found


if __name__ == "__main__":
    main()
