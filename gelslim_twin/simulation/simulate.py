"""Simulate a planned scene: solve the gel pose by pose, render it frame by frame, write both.

What was solved and rendered before an interruption is kept; the same call continues from there.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from gelslim_core.files.file_lock import beside, locked
from gelslim_core.files.replaced_file import json_bytes, replace_file
from gelslim_force.outputs.canvas import encoded
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.planning.plan import Plan
from gelslim_twin.scene.built_look import BuiltLook
from gelslim_twin.scene.pose import FrameTime, Pose, frame_times
from gelslim_twin.scene.scene import Scene
from gelslim_twin.simulation.records import FrameTruth, StateStore, fields_npz, wrench_csv
from gelslim_twin.simulation.run_folder import (
    FIELDS,
    LEDGER,
    PLAN,
    STATES,
    TRUTH,
    RunFolder,
    SimulationError,
    simulation_key,
)
from gelslim_twin.simulation.sensor import TwinSensor
from ifem_export.operators.single_thread import single_threaded

Progress = Callable[[str, int, int], None]


class Mechanics(Protocol):
    """Solves the gel along a path."""

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """A state per pose, from the first one on."""


@dataclass(frozen=True)
class SimulationJob:
    """Everything that `simulate` needs of one scene.

    Attributes:
        scene: The scene.
        poses: Poses of the tool.
        plan: The effects to simulate.
        sensor: The sensor.
        mechanics: Makes the solver; called only if there is something to solve.
        look: The look of the built sensor; None for that of the design.
    """

    scene: Scene
    poses: tuple[Pose, ...]
    plan: Plan
    sensor: TwinSensor
    mechanics: Callable[[], Mechanics]
    look: BuiltLook | None = None

    @property
    def key(self) -> str:
        """Hash of all input of the simulation."""
        bundle = self.sensor.bundle
        material = f"{bundle.material} {bundle.formulation}"
        if bundle.skin is not None:
            material += f" {bundle.skin}"
        scene = self.scene.model_dump_json(exclude={"look"}) + repr(self.poses)
        if self.look is not None:
            scene += self.look.digest
        return simulation_key(scene, self.plan.to_json(), bundle.geometry_hash, material)


@dataclass
class Ledger:
    """Times of the stages and the accuracy that the solver reached."""

    seconds: dict[str, float] = field(default_factory=dict)
    poses_solved: int = 0
    frames_drawn: int = 0
    frames_kept: int = 0
    solver_worst: dict[str, float] = field(default_factory=dict)
    """Largest residual, penetration and complementarity of any pose."""

    def add(self, stage: str, since: float) -> float:
        """Add the time since `since` to a stage; returns the present time."""
        now = time.perf_counter()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - since
        return now

    def judge(self, state: GelState) -> None:
        """Update the largest values that the solver reports."""
        for name, value in state.solver.items():
            self.solver_worst[name] = max(self.solver_worst.get(name, 0.0), float(value))

    def to_record(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


@single_threaded
def simulate(
    job: SimulationJob,
    folder: Path,
    *,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> Ledger:
    """Simulate a scene into a folder.

    Writes plan.json, truth.csv, truth.npz, frames/ where pictures are observed, ledger.json and,
    last, run.json with the state "complete". The solved poses in states/, from which an
    interrupted run continues, are then deleted. A complete folder is left as it is.

    Args:
        job: Scene, plan and sensor, for example from `job_of`.
        folder: Folder of the results.
        overwrite: Replace another simulation in this folder.
        progress: Called with the stage, the steps done and their number.

    Returns:
        Times of the stages and the accuracy that the solver reached.

    Raises:
        SimulationError: The folder holds something else or cannot be written.
        IfemError: The solver does not converge; the states solved before are kept.
    """
    place = Path(os.path.abspath(folder))
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SimulationError(f"{folder}: {reason}; choose a folder you can write to") from error
    with locked(beside(place, ".lock"), _say_waiting):
        return _simulated(job, folder, overwrite, progress or (lambda text, done, total: None))


def _say_waiting(lock: Path) -> None:
    print("Another gelslim is simulating into this folder; waiting for it", file=sys.stderr)


def _simulated(job: SimulationJob, folder: Path, overwrite: bool, tell: Progress) -> Ledger:
    if "image" in job.scene.observe:
        # A missing library for pictures must be reported before hours of solving, not after.
        encoded(np.zeros((1, 1, 3), dtype=np.uint8), ".png")
    run = RunFolder.opened(folder, job.key, overwrite)
    about = {"scene": job.scene.name, "observe": list(job.scene.observe), "seed": job.scene.seed}
    ledger = Ledger()
    if run.complete:
        run.remove_states()
        ledger.frames_kept = len(frame_times(job.poses, job.scene.camera.frame_rate_hz))
        return ledger
    run.mark("running", about)
    run.write(PLAN, job.plan.to_json().encode())
    states = _solved(job, StateStore(run.path / STATES), ledger, tell)
    truths = list(_seen(job, states, run, ledger, tell))
    points = job.sensor.points_mm
    run.write(TRUTH, wrench_csv(truths, points))
    run.write(FIELDS, fields_npz(truths, points, job.scene.observe))
    run.write(LEDGER, json_bytes(ledger.to_record()))
    run.mark("complete", {**about, "frames": len(truths), "poses": len(job.poses)})
    run.remove_states()
    return ledger


def _solved(job: SimulationJob, store: StateStore, ledger: Ledger, tell: Progress) -> StateStore:
    """States of all poses. Where all are stored, nothing is solved."""
    total = len(job.poses)
    if store.count < total:
        # The solution depends on the path, so the solver starts at the first pose again.
        kept = store.count
        started = time.perf_counter()
        for index, state in enumerate(job.mechanics().states(job.poses)):
            if index >= kept:
                store.append(state)
                ledger.poses_solved += 1
            tell("gel", index + 1, total)
        store.flush()
        ledger.add("gel", started)
    for index in range(total):
        ledger.judge(store[index])
    return store


def _seen(
    job: SimulationJob, states: StateStore, run: RunFolder, ledger: Ledger, tell: Progress
) -> Iterator[FrameTruth]:
    observe = job.scene.observe
    times = frame_times(job.poses, job.scene.camera.frame_rate_hz)
    viewer = None
    if "markers" in observe or "image" in observe:
        from gelslim_twin.simulation.picture import Viewer

        viewer = Viewer(job.sensor, job.plan, job.scene, job.look)
    before: GelState | None = None
    for number, when in enumerate(times):
        state = _at(states, when)
        started = time.perf_counter()
        truth = FrameTruth(number, when.time_s, _at(job.poses, when), state)
        if viewer is not None:
            truth = replace(truth, markers_px=viewer.markers_px(state))
            started = ledger.add("markers", started)
        if viewer is not None and "image" in observe:
            step_s = when.time_s - times[number - 1].time_s if number else 0.0
            drawn = viewer.frame(state, before, number, step_s)
            started = ledger.add("image", started)
            path = run.frame_path(number)
            if path.is_file():
                ledger.frames_kept += 1
            else:
                replace_file(path, encoded(np.asarray(drawn.image), ".png"))
                ledger.frames_drawn += 1
            ledger.add("write", started)
            truth = replace(truth, centroids_px=drawn.centres_px, drawn=drawn.drawn)
        before = state
        tell("frames", number + 1, len(times))
        yield truth


def _at(values: Any, when: FrameTime) -> Any:
    """The pose or state at the time of a frame."""
    first = values[when.before]
    return first if when.part == 0 else first.blended(values[when.before + 1], when.part)
