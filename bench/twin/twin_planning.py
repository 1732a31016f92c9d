"""What planning saves: the planner's choice against everything on, in the gallery and at random.

    python -m bench.twin.twin_planning                        # all that is not measured yet
    python -m bench.twin.twin_planning --again                # all, anew
    python -m bench.twin.twin_planning --processes 16         # the same on 16 processes
    python -m bench.twin.twin_planning --scene tilt           # one scene of the gallery anew
    python -m bench.twin.twin_planning --seeds 2000 2010      # random scenes of these seeds anew
    python -m bench.twin.twin_planning --quick                # two scenes, four seeds; printed only
    python -m bench.twin.twin_planning --draw                 # picture and tables from docs/data

The scenes of the gallery have their own tolerance, a loose one of 10 % and a tight one of 1 %; the
random scenes of the tests have four times as many poses and a tolerance drawn from 0.5 to 20 %.
Tolerances are of the largest force, and of the depth in pixels. Times are of the processor, so that
processes beside each other do not count. The rows of a scene are written to docs/data when it is
done, so that a stop loses those only that are under way. Set OMP_NUM_THREADS=1.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

from bench.bench_data import DOCS, see_tests, write_data, write_whole
from bench.rigs.machine import machine

see_tests("twin")

from bench.rigs.planning_tasks import Task, perform, warm  # noqa: E402
from bench.rigs.twin_rig import QUICK, SCENES, kept_sensor  # noqa: E402
from gelslim_core.jobs import Engine  # noqa: E402

NAME = "twin_planning"
SEEDS = range(2000, 2100)


def main() -> None:
    """Measure, print and write what is asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="few cases, printed only")
    parser.add_argument("--draw", action="store_true", help="measure nothing")
    parser.add_argument("--again", action="store_true", help="measure all, not what is missing")
    parser.add_argument("--docs", type=Path, help="folder to write data/ and images/ in")
    parser.add_argument("--scene", nargs="+", help="of the gallery")
    parser.add_argument("--seeds", nargs=2, type=int, help="of random scenes: from, and up to")
    parser.add_argument("--processes", type=int, default=1, help="how many work beside each other")
    parser.add_argument(
        "--sensor", type=Path, help="folder that keeps the sensor of the gallery for a later call"
    )
    parser.add_argument(
        "--runs",
        type=Path,
        help="folder that keeps everything on, solved and timed, for later",
    )
    options = parser.parse_args()
    docs = options.docs or (None if options.quick else DOCS)
    if options.draw:
        finish(docs or DOCS)
        return
    done = {} if options.quick or options.again else held(docs)
    with tempfile.TemporaryDirectory() as place:
        tasks = asked(options, place, done)
        if any(task.scene for task in tasks):
            kept_sensor(Path(tasks[0].sensor))
        if options.processes > 1:
            warm(place)
        measured: dict[str, Any] = {}
        for number, rows in Engine(options.processes).run(perform, tasks):
            for name in tasks[number].names:
                measured[name] = rows[name]
                print(f"{name:22s} {line(rows[name])}", flush=True)
            if docs is not None:
                keep(docs, measured)
    if docs is not None:
        finish(docs)


def asked(options: argparse.Namespace, place: str, done: dict[str, Any]) -> list[Task]:
    """The tasks of a call, those of the gallery first because they take longest."""
    sensor = str(options.sensor or Path(place) / "sensor")
    runs = None if options.runs is None else str(options.runs)
    scenes = options.scene or sorted(path.stem for path in SCENES.glob("*.yaml"))
    seeds = range(*options.seeds) if options.seeds else SEEDS
    if options.quick:
        scenes, seeds = options.scene or QUICK, (options.seeds and seeds) or list(seeds)[:4]
    every = []
    if options.scene or not options.seeds:
        every += [Task(place, scene=name, sensor=sensor, runs=runs) for name in scenes]
    if options.seeds or not options.scene:
        every += [Task(place, seed=seed, sensor=sensor, runs=runs) for seed in seeds]
    if options.scene or options.seeds:
        return every
    return [task for task in every if not all(name in done for name in task.names)]


def held(docs: Path | None) -> dict[str, Any]:
    """The rows that were measured already, by case."""
    path = (docs or DOCS) / "data" / f"{NAME}.json"
    if not path.exists():
        return {}
    return dict(json.loads(path.read_text(encoding="utf-8"))["cases"])


def keep(docs: Path, measured: dict[str, Any]) -> None:
    """Write rows with those that are there already, also those of another process."""
    cases = {**held(docs), **measured}
    ordered = {name: cases[name] for name in sorted(cases)}
    write_data(NAME, {**machine(), "seed": "of each scene", "cases": ordered}, docs)


def line(row: dict[str, Any]) -> str:
    """A row in short."""
    if "refused" in row:
        return f"refused: {row['refused'][:60]}"
    used = max(row["used"].values())
    return (
        f"{row['ms']:8.0f} of {row['whole_ms']:8.0f} ms ({row['ms'] / row['whole_ms']:.2f}), "
        f"planning {row['planning_ms']:5.0f} ms, used {used:6.1%}, kept {row['kept']}, "
        f"needless {','.join(row['needless'] or '-')}{'' if used <= 1 else '  ABOVE'}"
    )


def finish(docs: Path) -> None:
    """The figure, and the guide's table."""
    from bench.page.planning_figure import draw
    from bench.page_blocks import fill_pages

    try:
        write_whole(docs / "images" / f"{NAME}.png", draw(held(docs)))
    except ImportError as error:
        print(f"no picture is drawn: {error}", file=sys.stderr)
    if docs == DOCS:
        fill_pages()


if __name__ == "__main__":
    main()
