"""What planning saves: the planner's choice against everything on, in the gallery and at random.

    python bench/twin_planning.py                        # all that is not measured yet
    python bench/twin_planning.py --scene tilt           # one scene of the gallery anew
    python bench/twin_planning.py --seeds 2000 2010      # random scenes of these seeds anew
    python bench/twin_planning.py --quick                # two scenes and four seeds; printed only

The scenes of the gallery have their own tolerance, a loose one of 10 % and a tight one of 1 %; the
random scenes of the tests have four times as many poses and a tolerance drawn from 0.5 to 20 %.
Tolerances are of the largest force, and of the depth in pixels. Each case is written to docs/data
as it is done, so that a stop loses one only. Set OMP_NUM_THREADS=1.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import sys
import tempfile
from pathlib import Path
from typing import Any

from bench_data import DOCS, write_data, write_whole
from rigs.machine import machine

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "twin"))

from rigs.planning_cases import Case, Run, measured, prepared
from rigs.twin_rig import gallery, kept_sensor, plan_key

from gelslim_twin.contact.gel_state import ContactError

NAME = "twin_planning"
LEVELS = {"own": None, "loose": 0.1, "tight": 0.01}
SEEDS = range(2000, 2100)
LOWEST, HIGHEST = 0.005, 0.2


def main() -> None:
    """Measure, print and write what is asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="few cases, printed only")
    parser.add_argument("--docs", type=Path, help="folder to write data/ and images/ in")
    parser.add_argument("--scene", nargs="+", help="of the gallery")
    parser.add_argument("--seeds", nargs=2, type=int, help="of random scenes: from, and up to")
    options = parser.parse_args()
    docs = options.docs or (None if options.quick else DOCS)
    asked = options.scene or options.seeds
    done = {} if options.quick else held(docs)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        if options.scene or not asked:
            of_gallery(folder, options.scene, options.quick, done, docs)
        seeds = range(*options.seeds) if options.seeds else SEEDS
        if options.seeds or not asked:
            for seed in list(seeds)[:4] if options.quick else seeds:
                if options.seeds or f"seed {seed}" not in done:
                    keep(docs, done, f"seed {seed}", at_random(seed, folder))
    if docs is not None:
        finish(docs)


def of_gallery(
    folder: Path, names: list[str] | None, quick: bool, done: dict[str, Any], docs: Path | None
) -> None:
    """Every scene at its three tolerances; everything on is carried out once for equal rungs."""
    scenes = [s for s in gallery(quick) if not names or s.scene.name in names]
    missing = [
        s for s in scenes if names or any(f"{s.scene.name} {level}" not in done for level in LEVELS)
    ]
    sensor = kept_sensor(folder) if missing else None
    for loaded in missing:
        assert sensor is not None
        case = Case.of_gallery(loaded, sensor, folder)
        prepared(case)
        carried: dict[str, Run] = {}
        for name, level in LEVELS.items():
            at = case if level is None else relative(case, carried, level)
            row = measured(at, level, everything(at, carried), with_needless=False)
            keep(docs, done, f"{loaded.scene.name} {name}", {"scene": loaded.scene.name, **row})


def at_random(seed: int, folder: Path) -> dict[str, Any]:
    """A random scene at a random tolerance."""
    rng = random.Random(seed)
    level = math.exp(rng.uniform(math.log(LOWEST), math.log(HIGHEST)))
    carried: dict[str, Run] = {}
    try:
        case = Case.of_seed(seed, folder)
        prepared(case)
        at = relative(case, carried, level)
        return {"seed": seed, **measured(at, level, everything(at, carried))}
    except ContactError as error:
        return {"seed": seed, "level": level, "refused": str(error)}


def everything(case: Case, carried: dict[str, Run]) -> Run:
    """Everything on, carried out once for equal rungs."""
    key = plan_key(case.whole)
    if key not in carried:
        carried[key] = case.run(case.whole)
    return carried[key]


def relative(case: Case, carried: dict[str, Run], level: float) -> Case:
    """The case with a tolerance relative to its largest force and to its depth in pixels."""
    states = everything(case, carried).outcome.states
    force = max(float((s.force_n.sum(axis=0) ** 2).sum() ** 0.5) for s in states)
    c = case.trial.asked.circumstances
    depth_px = c.motion.depth_mm * c.sensor.px_per_mm
    return case.with_tolerance(max(level * force, 1e-9), max(level * depth_px, 1e-9))


def held(docs: Path | None) -> dict[str, Any]:
    """The rows that were measured already, by case."""
    path = (docs or DOCS) / "data" / f"{NAME}.json"
    if not path.exists():
        return {}
    return dict(json.loads(path.read_text(encoding="utf-8"))["cases"])


def keep(docs: Path | None, done: dict[str, Any], name: str, row: dict[str, Any]) -> None:
    """Print a row and write it with the others."""
    done[name] = row
    print(f"{name:22s} {line(row)}", flush=True)
    if docs is not None:
        # What another process has measured meanwhile is kept.
        done |= {**held(docs), name: row}
        ordered = {key: done[key] for key in sorted(done)}
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
    from page.planning_figure import draw
    from page_blocks import fill_pages

    cases = held(docs)
    write_whole(docs / "images" / f"{NAME}.png", draw(cases))
    if docs == DOCS:
        fill_pages()


if __name__ == "__main__":
    main()
