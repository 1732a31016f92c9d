"""Cases of the planning bench as independent tasks, one folder each, in any process."""

from __future__ import annotations

import math
import random
import shutil
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from bench.rigs.kept_runs import KeptRun, KeptRuns
from bench.rigs.planning_cases import Case, Run, measured, prepared
from bench.rigs.twin_rig import SCENES, mechanics_key, plan_key
from gelslim_twin.contact.gel_state import ContactError
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.simulation.sensor import stored_sensor

LEVELS = {"own": None, "loose": 0.1, "tight": 0.01}
LOWEST, HIGHEST = 0.005, 0.2
WARM_SEED = 2019
"""A random scene with friction, large strain and most effects of the picture."""

Rows = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Task:
    """A scene of the gallery at its three tolerances, or a random scene at a random one.

    Attributes:
        place: Folder in which the task makes one of its own.
        scene: Name of a file of `designs/scenes` without its ending; empty for a random scene.
        seed: Of a random scene.
        sensor: Folder of the stored sensor of the gallery, which is copied.
        runs: Folder that keeps everything on for later calls; None for none.
    """

    place: str
    scene: str = ""
    seed: int = 0
    sensor: str = ""
    runs: str | None = None

    @property
    def kept(self) -> KeptRuns:
        """Everything on, as a folder keeps it."""
        folder = None if self.runs is None else Path(self.runs)
        return KeptRuns(folder, self.scene or f"seed {self.seed}")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its rows."""
        if not self.scene:
            return (f"seed {self.seed}",)
        return tuple(f"{self.scene} {level}" for level in LEVELS)


def perform(task: Task) -> Rows:
    """The rows of a task by name. Everything is compiled before, so that no time counts it."""
    warm(task.place)
    with tempfile.TemporaryDirectory(dir=task.place) as place:
        folder = Path(place)
        return of_gallery(task, folder) if task.scene else at_random(task, folder)


@cache
def warm(place: str) -> None:
    """Carry out a random scene once in this process."""
    with tempfile.TemporaryDirectory(dir=place) as folder:
        case = Case.of_seed(WARM_SEED, Path(folder))
        prepared(case)
        measured(case, None, case.run(case.whole), with_needless=False)


def of_gallery(task: Task, folder: Path) -> Rows:
    """A scene at its three tolerances; everything on is carried out once for equal rungs."""
    kept = folder / "sensor"
    shutil.copytree(task.sensor, kept)
    case = Case.of_gallery(read_scene(SCENES / f"{task.scene}.yaml"), stored_sensor(kept), kept)
    carried: dict[str, Run] = {}
    rows = Rows()
    for name, level in LEVELS.items():
        try:
            if not carried:
                prepared(case)
            at = case if level is None else relative(case, carried, task.kept, level)
            row = measured(at, level, everything(at, carried, task.kept))
        except ContactError as error:
            row = {"level": level, "refused": str(error)}
        rows[f"{task.scene} {name}"] = {"scene": task.scene, **row}
    return rows


def at_random(task: Task, folder: Path) -> Rows:
    """A random scene at a random tolerance."""
    rng = random.Random(task.seed)
    level = math.exp(rng.uniform(math.log(LOWEST), math.log(HIGHEST)))
    carried: dict[str, Run] = {}
    try:
        case = Case.of_seed(task.seed, folder)
        prepared(case)
        at = relative(case, carried, task.kept, level)
        row = measured(at, level, everything(at, carried, task.kept))
    except ContactError as error:
        row = {"level": level, "refused": str(error)}
    return {f"seed {task.seed}": {"seed": task.seed, **row}}


def everything(case: Case, carried: dict[str, Run], kept: KeptRuns) -> Run:
    """Everything on, carried out once for equal rungs."""
    plan = case.whole
    key = plan_key(plan)
    if key not in carried:
        known = kept.read(key)
        if known is None:
            run = case.run(plan)
            kept.keep(key, KeptRun(run.outcome.states, run.gel_ms, run.frames_ms))
        else:
            outcome = case.trial.carried_out(plan, known.states)
            run = Run(outcome, known.gel_ms, known.frames_ms)
            case.kept[mechanics_key(plan)] = known.states
            case.draw_once(run.outcome)
        carried[key] = run
    return carried[key]


def relative(case: Case, carried: dict[str, Run], kept: KeptRuns, level: float) -> Case:
    """The case with a tolerance relative to its largest force and to its depth in pixels."""
    states = everything(case, carried, kept).outcome.states
    force = max(float((s.force_n.sum(axis=0) ** 2).sum() ** 0.5) for s in states)
    c = case.trial.asked.circumstances
    depth_px = c.motion.depth_mm * c.sensor.px_per_mm
    return case.with_tolerance(max(level * force, 1e-9), max(level * depth_px, 1e-9))
