"""Twin: cost and worth of every effect on the gallery, the contact's ladders, planning's cost.

    python -m bench.twin.twin_ladders                  # writes docs/data, docs/images and the guide
    python -m bench.twin.twin_ladders --only contact   # measures one part anew, keeps the others
    python -m bench.twin.twin_ladders --scene tilt     # one scene anew
    python -m bench.twin.twin_ladders --quick          # two scenes in a linear gel; printed only

Every effect's milliseconds with and without it, and the error of leaving it out; what is left
when effects are dropped one by one, with the planner's choice; solver tolerance, load steps and
mesh layers against a tighter or finer solution; `simulate` against a loop by hand. Medians of CPU
time of calls in turns. Set OMP_NUM_THREADS=1.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench.bench_data import DOCS, write_data, write_whole
from bench.rigs.machine import machine
from bench.rigs.twin_contact import layer_ladder, solver_ladders
from bench.rigs.twin_gallery import drops, effect_rows
from bench.rigs.twin_overhead import overhead
from bench.rigs.twin_rig import SPEC, KeptBench, gallery, kept_sensor
from gelslim_twin.scene.reader import LoadedScene
from gelslim_twin.simulation.sensor import TwinSensor

NAME = "twin_ladders"
POSES = 4
"""Of a scene, with its last and its deepest: up to two more."""

Part = Callable[[TwinSensor, Path, bool], Any]


def scene_part(
    loaded: LoadedScene, sensor: TwinSensor, folder: Path, quick: bool
) -> dict[str, Any]:
    """Every effect on one scene, and effects dropped one by one."""
    bench, rounds = KeptBench(loaded, sensor, folder, POSES), 2 if quick else 5
    rows = effect_rows(bench, rounds, quick)
    for row in rows:
        print("  " + effect_line(row))
    return {"poses_at_most": POSES + 2, "effects": rows, "drops": drops(bench, rows, rounds, quick)}


def overhead_part(sensor: TwinSensor, folder: Path, quick: bool) -> dict[str, Any]:
    """Planning and bookkeeping against a loop by hand."""
    return {"overhead": overhead(sensor, folder, quick)}


PARTS: dict[str, Part] = {
    "overhead": overhead_part,
    "contact": solver_ladders,
    "layers": layer_ladder,
}
SCENES = "scenes"


def main() -> None:
    """Measure, print, write JSON, figures and tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="reduced, printed only")
    parser.add_argument("--docs", type=Path, help="folder to write data/ and images/ in")
    parser.add_argument("--only", choices=[*PARTS, SCENES], help="keep the rest")
    parser.add_argument("--scene", nargs="+", help="of the gallery; the others as they were")
    options = parser.parse_args()
    docs = options.docs or (None if options.quick else DOCS)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        sensor = kept_sensor(folder)
        asked = SCENES if options.scene else options.only
        for name, part in PARTS.items():
            if asked in (None, name):
                keep(docs, name, part(sensor, folder, options.quick))
        for loaded in gallery(options.quick) if asked in (None, SCENES) else []:
            if not options.scene or loaded.scene.name in options.scene:
                print(f"{loaded.scene.name}:", flush=True)
                keep(docs, SCENES, scene_part(loaded, sensor, folder, options.quick))
    if docs is not None:
        finish(docs)


def held(docs: Path) -> dict[str, Any]:
    """What has been measured already."""
    path = docs / "data" / f"{NAME}.json"
    return dict(json.loads(path.read_text(encoding="utf-8"))) if path.exists() else {}


def keep(docs: Path | None, name: str, found: dict[str, Any]) -> None:
    """Print one part or scene and put it into the JSON: a stop loses one only."""
    show(found)
    if docs is None:
        return
    before = held(docs)
    # How busy the machine was with other work, whose noise the medians still have.
    loads = {**before.get("load_average", {}), name: round(os.getloadavg()[0], 1)}
    about = {**machine(), "seed": "of each scene", "design": SPEC.name, "load_average": loads}
    if name == SCENES:
        (scene,) = {r["scene"] for r in found["effects"]}
        for key in ("effects", "drops"):
            others = [r for r in before.get(key, []) if r["scene"] != scene]
            found[key] = sorted([*others, *found[key]], key=lambda r: str(r["scene"]))
    write_data(
        NAME, {**about, **{k: v for k, v in before.items() if k not in about}, **found}, docs
    )


def finish(docs: Path) -> None:
    """Figures of what has been measured, and the guide's tables."""
    from bench.page.twin_figures import draw_contact, draw_scenes
    from bench.page_blocks import fill_pages

    data = held(docs)
    if "drops" in data:
        write_whole(docs / "images" / "twin_effects.png", draw_scenes(data["drops"]))
    if "contact" in data:
        write_whole(docs / "images" / "twin_contact.png", draw_contact(data))
    if docs == DOCS:
        fill_pages()


def effect_line(row: dict[str, Any]) -> str:
    """One effect of one scene."""
    errors = ", ".join(f"{k} {v:.3g} <= {row['bound'][k]:.3g}" for k, v in row["error"].items())
    short = f"  BOUND TOO SMALL: {row['short']}" if row["short"] else ""
    return (
        f"{row['effect']:15s} {row['ms_with']:8.2f} {row['ms_without']:8.2f} ms  "
        f"{row['auto']:12s} {errors}{short}"
    )


def show(found: dict[str, Any]) -> None:
    """A line per rung; effects are printed as they come."""
    for key, value in found.items():
        for row in value if isinstance(value, list) else [value]:
            if key == "effects" or not isinstance(row, dict):
                continue
            cells = [
                f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}"
                for k, v in row.items()
                if k not in ("effects", "error")
            ]
            print(f"  {key}: " + "  ".join(cells), flush=True)


if __name__ == "__main__":
    main()
