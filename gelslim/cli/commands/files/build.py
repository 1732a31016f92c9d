"""`gelslim build`: all files of a finger."""

from __future__ import annotations

import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import RULE_FAILED, print_json, progress_bar, say
from gelslim.cli.commands.design.check import print_problems
from gelslim.cli.options import AsJson, SpecFile, out_folder

if TYPE_CHECKING:
    from gelslim_cad.build import BuildResult

COST = "orders/cost.json"
"""File of a build with what the finger costs."""


def build(
    spec: SpecFile,
    out: Annotated[Path | None, out_folder("out/NAME")] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            "-j",
            "--jobs",
            min=1,
            max=256,
            help="Number of processes; by default one per processor, at most 4.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> int:
    """Build every file of a finger.

    Writes a folder with CAD, print, mould, laser and marker files, the sensor's bundle, building
    instructions and a report. Only what changed is made again. If a design rule fails, nothing is
    written and the exit status is 1.
    """
    from gelslim_cad.build import BuildRefusedError, build_variant
    from gelslim_cad.tolerance.asked import read_spec

    started = time.monotonic()
    folder = out or Path("out") / read_spec(spec).spec.name
    try:
        with progress_bar(quiet=as_json) as tell:
            result = build_variant(spec, folder, jobs=jobs, progress=tell)
    except BuildRefusedError as refused:
        failed = [c for c in refused.checks if c.status == "fail"]
        if as_json:
            failures = [asdict(c) for c in failed]
            print_json({"ok": False, "message": str(refused), "failed": failures})
        elif failed:
            print_problems(failed)
            print(f"{str(refused).splitlines()[0]}. `gelslim check {spec}` shows what would help.")
        else:
            print(refused, file=sys.stderr)
        return RULE_FAILED
    if as_json:
        print_json(_record(result))
    else:
        _report(result, time.monotonic() - started)
    return 0


def _record(result: BuildResult) -> dict[str, Any]:
    return {
        "ok": True,
        "folder": str(result.folder),
        "up_to_date": result.up_to_date,
        "rebuilt": result.rebuilt,
        "files": result.files,
        "cost": _cost(result),
        "warnings": [asdict(c) for c in result.checks if c.status == "warn"],
        "binding": result.binding,
        "left_out": result.left_out,
    }


def _cost(result: BuildResult) -> dict[str, Any] | None:
    """What the finger costs, as the build wrote it."""
    if COST not in result.files:
        return None
    return dict(json.loads((result.folder / COST).read_text("utf-8")))


def _report(result: BuildResult, seconds: float) -> None:
    warnings = [c for c in result.checks if c.status == "warn"]
    here = Path.cwd()
    folder = result.folder
    shown = folder.relative_to(here) if folder.is_relative_to(here) else folder
    if result.up_to_date:
        print(f"Up to date: {len(result.files)} files in {shown} ({seconds:.1f} s)")
    else:
        print_problems(warnings)
        if result.binding:
            say(result.binding[0])
        print(f"Built {len(result.files)} files in {shown} ({seconds:.1f} s)")
    for sentence in result.left_out:
        say(sentence[0].upper() + sentence[1:] + ".")
    cost = _cost(result)
    if cost is not None:
        say(cost["sentence"])
    for name, purpose in (
        ("report.html", "open this first"),
        ("BUILD.html", "how to make the finger, step by step"),
        ("orders/ORDER.md", "what to order where"),
    ):
        if name in result.files:
            print(f"  {shown / name}  {purpose}")
