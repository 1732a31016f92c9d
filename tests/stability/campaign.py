"""Build random specs, each in its own process, and file what became of them.

    python -m tests.stability.run --count 300 --seed 1

Exit status 0 when every spec was built and proved or refused with a reason, else 1.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from .case import STAGES, Outcome, Stage, run_case
from .legal_specs import Sample, sample

MEMORY_BYTES = 6 * 1024**3
"""Address space of one case; a build that wants more is filed as failed."""
QUIET_SIGNALS = {9: "killed", 11: "segmentation fault", 6: "abort"}


@dataclass(frozen=True)
class Filed:
    """A sample and its outcome."""

    seed: int
    index: int
    kind: str
    seconds: float
    outcome: Outcome


@dataclass
class _Running:
    sample: Sample
    process: Any
    pipe: Connection
    started: float
    stage: str = "start"


def run_many(
    samples: Iterable[Sample],
    folder: Path,
    *,
    last: Stage = "files",
    jobs: int = 2,
    timeout_s: float = 120.0,
) -> Iterator[Filed]:
    """Outcomes of the samples, each run in a process of its own, as they come in."""
    method = "fork" if sys.platform.startswith("linux") else "spawn"
    context = multiprocessing.get_context(method)
    queue = iter(samples)
    running: list[_Running] = []
    more = True
    while more or running:
        while more and len(running) < jobs:
            chosen = next(queue, None)
            if chosen is None:
                more = False
                break
            running.append(_start(context, chosen, folder, last))
        if running:
            wait([r.pipe for r in running], timeout=1.0)
        for r in list(running):
            outcome = _outcome(r, timeout_s)
            if outcome is not None:
                running.remove(r)
                seconds = round(time.monotonic() - r.started, 2)
                yield Filed(r.sample.seed, r.sample.index, r.sample.kind, seconds, outcome)


def _start(context: Any, chosen: Sample, folder: Path, last: Stage) -> _Running:
    path = folder / f"{chosen.spec.name}.yaml"
    path.write_text(chosen.text, encoding="utf-8")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_child, args=(path, last, theirs), daemon=True)
    process.start()
    theirs.close()
    return _Running(chosen, process, ours, time.monotonic())


def _child(path: Path, last: Stage, pipe: Connection) -> None:
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    pipe.send(run_case(path, last, pipe.send))


def _outcome(r: _Running, timeout_s: float) -> Outcome | None:
    """The outcome of a case that ended, or must end; None while it runs."""
    try:
        while r.pipe.poll():
            message = r.pipe.recv()
            if isinstance(message, Outcome):
                r.process.join()
                return message
            r.stage = message
    except EOFError:
        r.process.join()
        code = r.process.exitcode
        kind = QUIET_SIGNALS.get(-code, f"signal {-code}") if code < 0 else f"exit status {code}"
        return Outcome("failed", r.stage, (f"process died: {kind} in {r.stage}",))
    if time.monotonic() - r.started < timeout_s:
        return None
    r.process.kill()
    r.process.join()
    return Outcome("failed", r.stage, (f"timeout in {r.stage}",), f"over {timeout_s:g} s")


def summary(filed: list[Filed]) -> dict[str, Any]:
    """Counts by outcome and by reason, and every failure."""
    by_status = Counter(f.outcome.status for f in filed)
    reached = sum(f.outcome.solids > 0 or f.outcome.stage not in ("spec", "rules") for f in filed)
    return {
        "specs": len(filed),
        "built_and_proved": by_status["built"],
        "refused_with_a_reason": by_status["refused"],
        "refused_on_the_solids": by_status["refused_on_solids"],
        "failed": by_status["failed"],
        "reached_cad": reached,
        "proofs": sum(f.outcome.proofs for f in filed),
        "refusals_by_rule": dict(
            Counter(
                r
                for f in filed
                if f.outcome.status.startswith("refused")
                for r in f.outcome.reasons
            ).most_common()
        ),
        "failures_by_kind": dict(
            Counter(
                r for f in filed if f.outcome.status == "failed" for r in f.outcome.reasons
            ).most_common()
        ),
        "cases": [asdict(f) for f in sorted(filed, key=lambda f: f.index)],
    }


def shown(result: dict[str, Any]) -> str:
    """The summary in words."""
    count = max(result["specs"], 1)
    lines = [
        f"{result['specs']} specs: {result['built_and_proved']} built and proved "
        f"({result['proofs']} proofs), {result['refused_with_a_reason']} refused by spec or rules, "
        f"{result['refused_on_the_solids']} refused on the solids, {result['failed']} failed",
        f"{result['reached_cad']} reached CAD ({result['reached_cad'] / count:.0%})",
        "refusals by rule:",
        *(f"  {n:4d}  {rule}" for rule, n in result["refusals_by_rule"].items()),
    ]
    if result["failures_by_kind"]:
        lines += ["failures by kind:"]
        lines += [f"  {n:4d}  {kind}" for kind, n in result["failures_by_kind"].items()]
    for case in result["cases"]:
        outcome = case["outcome"]
        if outcome["status"] in ("failed", "refused_on_solids"):
            lines.append(
                f"seed {case['seed']} index {case['index']} ({case['kind']}): "
                f"{outcome['status']}: {', '.join(outcome['reasons'])}: {outcome['detail'][:300]}"
            )
    return "\n".join(lines)


def load_kernel() -> None:
    """Load what every case needs before processes fork from this one."""
    import gelslim_cad.build.documents
    import gelslim_cad.build.stages
    import gelslim_cad.build.writers
    import gelslim_cad.solids.finger
    import gelslim_cad.solids.tooling  # noqa: F401


def main() -> int:
    """Command line; the exit status."""
    parser = argparse.ArgumentParser(prog="tests.stability.run", description=__doc__)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="index of the first spec")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--timeout", type=float, default=120.0, help="seconds per spec")
    parser.add_argument("--stage", choices=STAGES, default="files", help="how far to go")
    parser.add_argument("--json", type=Path, default=Path("out/stability.json"))
    arguments = parser.parse_args()
    load_kernel()
    samples = (
        sample(arguments.seed, arguments.first + offset) for offset in range(arguments.count)
    )
    filed: list[Filed] = []
    with tempfile.TemporaryDirectory(prefix="gelslim-stability-") as scratch:
        for item in run_many(
            samples,
            Path(scratch),
            last=arguments.stage,
            jobs=arguments.jobs,
            timeout_s=arguments.timeout,
        ):
            filed.append(item)
            words = ", ".join(item.outcome.reasons[:3])
            print(
                f"[{len(filed)}/{arguments.count}] index {item.index} {item.outcome.status} "
                f"{item.seconds:.1f} s {words}",
                file=sys.stderr,
                flush=True,
            )
    result = summary(filed)
    arguments.json.parent.mkdir(parents=True, exist_ok=True)
    arguments.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    print(shown(result))
    return 1 if result["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
