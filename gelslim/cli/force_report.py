"""What `gelslim force` says at its end: a few lines, or JSON."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gelslim_force.pipeline import ForcePipeline
    from gelslim_force.run import RunSummary


def answer_json(
    folder: Path, pipeline: ForcePipeline, summary: RunSummary, pictures: list[str]
) -> None:
    """Print the run's folder, counts, last wrench (N, N mm) and median times (ms) as JSON."""
    from gelslim.cli.answer import print_json
    from gelslim_force.outputs.packed_frame import plain

    wrench = summary.last.wrench if summary.last is not None else None
    print_json(
        {
            "folder": str(folder),
            "operator": pipeline.operator_name,
            "frames": summary.frames,
            "frames_with_forces": summary.with_forces,
            "problems": summary.problems,
            "least_coverage": summary.least_coverage,
            "last_wrench": None if wrench is None else plain(wrench.vector),
            "last_sigma": None if wrench is None else plain(wrench.standard_deviation),
            "stages_ms": {t.stage: t.median_ms for t in summary.stages},
            "pictures": pictures,
        }
    )


def report(folder: Path, pipeline: ForcePipeline, summary: RunSummary, pictures: list[str]) -> None:
    """Say how many frames got forces, the last wrench, problems, times and where all is."""
    from gelslim.cli.answer import say

    say(f"{summary.frames} frames, {summary.with_forces} with forces, by {pipeline.operator_name}.")
    wrench = summary.last.wrench if summary.last is not None else None
    if wrench is not None:
        names = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
        units = ("N",) * 3 + ("N mm",) * 3
        parts = [
            f"{n} unknown" if v != v else f"{n} {v:+.3f} ± {s:.3f} {u}"
            for n, v, s, u in zip(
                names, wrench.vector, wrench.standard_deviation, units, strict=True
            )
        ]
        say("Last frame: " + ", ".join(parts) + ".")
    for problem, count in sorted(summary.problems.items(), key=lambda item: -item[1])[:5]:
        say(f"{count} frames: {problem}.", style="yellow")
    total = next((t for t in summary.stages if t.stage == "total"), None)
    if total is not None:
        stages = ", ".join(
            f"{t.stage} {t.median_ms:.1f}" for t in summary.stages if t.stage != "total"
        )
        say(f"Median {total.median_ms:.1f} ms per frame ({stages}).")
    say(f"Run in {folder}/" + (f", {len(pictures)} pictures in {folder}/pictures/" if pictures
                               else ""))  # fmt: skip
