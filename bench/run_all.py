"""Run every bench, one after the other, then make the page of all ladders.

    python -m bench.run_all                             # in full: docs/data, images and the page
    python -m bench.run_all --quick                     # reduced, into out/bench, under 5 minutes
    python -m bench.run_all --only optics.light_rays    # that one and the page

A bench that fails is named at the end and leaves its old numbers; the exit code is then 1. One
thread each, and never two at once: they would take each other's time.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from bench.bench_data import DOCS

QUICK_DOCS = Path("out") / "bench"
QUICK_MOST_S = 300.0


@dataclass(frozen=True)
class Step:
    """A bench with its arguments in full and in quick mode; None where it has no quick mode."""

    name: str
    full: tuple[str, ...] = ()
    quick: tuple[str, ...] | None = ("--quick",)
    writes: bool = True
    """Whether it takes --docs."""


STEPS = (
    Step("stiffness.stiffness_ladder"),
    Step("stiffness.operator_contacts"),
    Step("optics.light_rays", quick=("--rays", "12", "--reference", "18", "--ladder-alone")),
    Step("designs.tessellation"),
    Step("optics.camera_models"),
    Step("force.force_ladders"),
    Step("force.normal_sources"),
    Step("force.force_sigma", quick=None),
    Step("force.compressed_pictures", quick=None),
    Step("twin.twin_ladders"),
    Step("twin.twin_planning"),
    Step("twin.twin_steps"),
    Step("twin.twin_batch"),
    Step("twin.twin_fine"),
    Step("learning.learned_forces", quick=None),
    Step("force.robot_observation", quick=None, writes=False),
    Step("force.press_slip", quick=None, writes=False),
    Step("twin.twin_skin"),
    Step("twin.linear_gel"),
    Step("twin.twin_look", quick=None, writes=False),
    Step("twin.rendering"),
    Step("stiffness.assembly"),
    Step("force.force_latency", ("--frames", "3000"), ("--quick", "--timed", "96")),
    Step("optics.refraction", quick=("--points", "100000", "--runs", "3"), writes=False),
    Step(
        "designs.design_batch",
        quick=("--count", "500", "--jobs", "1", "--repeats", "1"),
        writes=False,
    ),
    Step("force.force_overlay", quick=None, writes=False),
    Step("stiffness.stiffness_cases", quick=None),
    Step("designs.tolerance_yields", quick=("--samples", "256")),
    Step("page_blocks", quick=None, writes=False),
)
PAGE = "accuracy_page"


def main() -> None:
    """Run the steps; exit 1 where one failed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="reduced size, into out/bench")
    parser.add_argument("--only", nargs="+", choices=[s.name for s in STEPS], metavar="BENCH")
    parser.add_argument("--docs", type=Path, help="folder like docs to write in")
    asked = parser.parse_args()
    docs = asked.docs or (QUICK_DOCS if asked.quick else DOCS)
    begun, failed = time.perf_counter(), []
    for step in STEPS:
        if asked.only and step.name not in asked.only:
            continue
        arguments = arguments_of(step, asked.quick, docs)
        if arguments is not None and not ran(step.name, arguments):
            failed.append(step.name)
    if not ran(PAGE, ("--docs", str(docs))):
        failed.append(PAGE)
    took = time.perf_counter() - begun
    print(f"{took:.0f} s in all")
    if asked.quick and took > QUICK_MOST_S:
        print(f"longer than {QUICK_MOST_S:.0f} s: this machine is slow or busy")
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


def arguments_of(step: Step, quick: bool, docs: Path) -> tuple[str, ...] | None:
    """Arguments of a bench, or None where the mode leaves it out."""
    own = step.quick if quick else step.full
    if own is None or not step.writes:
        return own
    return (*own, "--docs", str(docs))


def ran(name: str, arguments: tuple[str, ...]) -> bool:
    """Run one bench on one thread; whether it succeeded."""
    print(f"== {name} {' '.join(arguments)}", flush=True)
    begun = time.perf_counter()
    command = [sys.executable, "-m", f"bench.{name}", *arguments]
    code = subprocess.run(command, env={"OMP_NUM_THREADS": "1", **os.environ}).returncode
    print(f"== {name}: {time.perf_counter() - begun:.0f} s", flush=True)
    return code == 0


if __name__ == "__main__":
    main()
