"""What planning and bookkeeping cost: `simulate` against a loop with the same stages by hand.

The loop has its effects, rungs and order written into it and writes the same files; `simulate`
plans, imports by name and keeps a ledger. Both run in turns, each into a fresh folder.
"""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench.rigs.twin_rig import SCENES, TwinSensor
from gelslim_core.files.replaced_file import json_bytes, replace_file
from gelslim_force.outputs.canvas import encoded
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.planning.question import plan_scene
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.render.frame_renderer import FrameRenderer
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.render.surroundings import Pad
from gelslim_twin.scene.reader import LoadedScene, read_scene
from gelslim_twin.simulation.picture import MOTTLE, VIGNETTING, Viewer
from gelslim_twin.simulation.records import FrameTruth, StateStore, fields_npz, wrench_csv
from gelslim_twin.simulation.run_folder import LEDGER, PLAN, RunFolder
from gelslim_twin.simulation.scene_task import job_of
from gelslim_twin.simulation.sensor import BUNDLE
from gelslim_twin.simulation.simulate import Ledger, simulate
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.markers.interpolation import marker_to_node

SCENE = "shear_sphere"
"""Thirty poses in a linear gel with pictures: quick stages, in which overhead shows most."""


@dataclass(frozen=True)
class ByHand:
    """What the plan of the scene comes to, as values."""

    loaded: LoadedScene
    sensor: TwinSensor
    folder: Path
    settings: ContactSettings
    camera: VirtualCamera
    look: Any

    @classmethod
    def like_plan(cls, loaded: LoadedScene, sensor: TwinSensor, folder: Path) -> ByHand:
        """The values that planning finds, found once and not timed."""
        plan = plan_scene(loaded, bundle_figures(folder / BUNDLE))
        viewer = Viewer(sensor, plan, loaded.scene)
        knobs = [
            dict(plan.choice(n).rung_parameters)["tolerance"]
            for n in ("normal_contact", "friction")
        ]
        settings = ContactSettings(min(knobs), loaded.scene.contact.friction)
        return cls(loaded, sensor, folder, settings, viewer.camera, viewer.renderer.look)

    def run(self, out: Path) -> None:
        """Solve, look, write: the files of `simulate` but for plan and ledger."""
        scene, sensor = self.loaded.scene, self.sensor
        (out / "frames").mkdir(parents=True)
        (out / "states").mkdir()
        tool = Tool.of(scene.indenters, self.loaded.folder, scene.seed)
        solver = ContactSolver(SurfaceCompliance(sensor.bundle, self.folder), tool, self.settings)
        states = StateStore(out / "states")
        for state in solver.states(self.loaded.poses):
            states.append(state)
        states.flush()
        pad = Pad(
            *sensor.size_mm,
            sensor.corner_radius_mm,
            mottle=MOTTLE,
            vignetting=VIGNETTING,
            seed=scene.seed,
        )
        renderer = FrameRenderer(self.camera, sensor.grid, sensor.light(), pad, self.look)
        points, places = sensor.points_mm, sensor.grid.positions_mm
        to_markers = marker_to_node(points, places)
        rest = np.column_stack([places, to_markers @ points[:, 2]])
        truths, before = [], None
        for k, (pose, state) in enumerate(zip(self.loaded.poses, states, strict=True)):
            step_s = pose.time_s - self.loaded.poses[k - 1].time_s if k else 0.0
            dots = self.camera.project(rest + to_markers @ state.displacement_mm)
            surface = SurfaceState.from_nodes(points, state.displacement_mm)
            drawn = renderer.frame(surface, before, number=k, step_s=step_s)
            picture = encoded(np.asarray(drawn.image), ".png")
            replace_file(out / "frames" / f"frame_{k:06d}.png", picture)
            truths.append(
                FrameTruth(k, pose.time_s, pose, state, dots, drawn.centres_px, drawn.drawn)
            )
            before = surface
        replace_file(out / "truth.csv", wrench_csv(truths, points))
        replace_file(out / "truth.npz", fields_npz(truths, points, scene.observe))
        replace_file(out / "run.json", json_bytes({"frames": len(truths)}))
        shutil.rmtree(out / "states")


def overhead(sensor: TwinSensor, folder: Path, quick: bool) -> dict[str, Any]:
    """Least times of pairs run one after the other; median and quartiles of the pairs' ratios.

    The work is the same each time, so what is above the least is other work on the machine: a
    hundredth is not to be seen otherwise. Seconds are of this process's CPU. Raises
    AssertionError where the two do not write the same bytes.
    """
    loaded = read_scene(SCENES / f"{SCENE}.yaml")
    hand = ByHand.like_plan(loaded, sensor, folder)
    ours, theirs = folder / "planned", folder / "by_hand"

    def planned() -> None:
        simulate(job_of(loaded, sensor, folder), ours)

    pairs = []
    for number in range(4 if quick else 41):
        # Who comes first takes turns: the second one finds the caches warm.
        if number % 2:
            by_hand = spent(lambda: hand.run(theirs), theirs)
            pairs.append((spent(planned, ours), by_hand))
        else:
            pairs.append((spent(planned, ours), spent(lambda: hand.run(theirs), theirs)))
    pairs = pairs[1:]
    same_files(ours, theirs)
    cpu = np.array([[a[0], b[0]] for a, b in pairs])
    wall = np.array([[a[1], b[1]] for a, b in pairs])
    alone = folder / "bookkeeping"
    kept = [spent(lambda: bookkeeping(loaded, sensor, folder, alone), alone)[0] for _ in range(31)]
    plan = [spent(lambda: plan_scene(loaded, bundle_figures(folder / BUNDLE)))[0] for _ in range(9)]
    more = cpu[:, 0] / cpu[:, 1] - 1
    return {
        "scene": SCENE,
        "poses": len(loaded.poses),
        "pairs": len(pairs),
        "planned_ms": 1000 * float(cpu[:, 0].min()),
        "by_hand_ms": 1000 * float(cpu[:, 1].min()),
        "overhead": float(cpu[:, 0].min() / cpu[:, 1].min() - 1),
        "median": float(np.median(more)),
        "quartiles": [float(v) for v in np.quantile(more, (0.25, 0.75))],
        "wall_overhead": float(np.median(wall[:, 0] / wall[:, 1] - 1)),
        "plan_ms": 1000 * float(np.median(plan)),
        "bookkeeping_ms": 1000 * float(np.median(kept)),
        "bookkeeping": float(np.median(kept) / np.median(cpu[:, 1])),
    }


def bookkeeping(loaded: LoadedScene, sensor: TwinSensor, folder: Path, place: Path) -> None:
    """All that `simulate` does and the loop by hand does not, on its own.

    Plan, key, folder and records; the loop writes a run.json too, which is not taken off. A
    hundredth of the whole is less than runs differ by on a busy machine; this is not.
    """
    job = job_of(loaded, sensor, folder)
    run, about = RunFolder.opened(place, job.key), {"scene": loaded.scene.name}
    ledger = Ledger()
    run.mark("running", about)
    run.write(PLAN, job.plan.to_json().encode())
    for name in ("markers", "image", "write") * len(job.poses):
        ledger.add(name, time.perf_counter())
    run.write(LEDGER, json_bytes(ledger.to_record()))
    run.mark("complete", about)


def spent(call: Callable[[], Any], fresh: Path | None = None) -> tuple[float, float]:
    """CPU and wall seconds of a call, which starts without the folder `fresh`."""
    if fresh is not None:
        shutil.rmtree(fresh, ignore_errors=True)
    started = time.process_time(), time.perf_counter()
    call()
    return time.process_time() - started[0], time.perf_counter() - started[1]


def same_files(ours: Path, theirs: Path) -> None:
    """Raise AssertionError where pictures or truth differ by a byte."""
    names = sorted(p.relative_to(theirs) for p in theirs.rglob("*") if p.is_file())
    for name in names:
        if name.name != "run.json":
            assert (ours / name).read_bytes() == (theirs / name).read_bytes(), name
    assert json.loads((ours / "run.json").read_bytes())["state"] == "complete"
