"""`gelslim validate` on the design, kept for the guide's table.

    python -m bench.twin.twin_validation                           # some minutes
    python -m bench.twin.twin_validation --from validation.json    # of a run just made

Writes docs/data/twin_validation.json and fills the pages' tables.

The record is the command's own, without its single frames.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from bench.bench_data import ROOT, write_data
from bench.page_blocks import fill_pages
from bench.rigs.machine import machine

SPEC = "designs/gelslim2.yaml"
LEFT_OUT = ("frames",)


def main() -> None:
    """Run or read, keep, write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--from", dest="made", type=Path, help="validation.json of a run")
    made = parser.parse_args().made
    started = time.perf_counter()
    record = json.loads(made.read_text(encoding="utf-8")) if made else validated()
    seconds = None if made else round(time.perf_counter() - started)
    kept = {k: v for k, v in record.items() if k not in LEFT_OUT}
    # Of the last quarter of an hour: how busy the machine was with other work meanwhile.
    kept |= {"load_average": round(os.getloadavg()[2], 1)} if seconds else {}
    write_data("twin_validation", {**machine(0), "design": SPEC, "seconds": seconds, **kept})
    fill_pages()


def validated() -> dict[str, Any]:
    """The command's record, from a process of its own. Raises CalledProcessError."""
    with tempfile.TemporaryDirectory() as place:
        command = [sys.executable, "-m", "gelslim", "validate", SPEC, "-o", place]
        done = subprocess.run(
            [*command, "--no-pictures", "--json"], cwd=ROOT, check=True, stdout=subprocess.PIPE
        )
    found: dict[str, Any] = json.loads(done.stdout)
    return found


if __name__ == "__main__":
    main()
