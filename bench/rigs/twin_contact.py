"""Contact ladders: field error against a tighter or finer solution, and time.

The scene is shear_sphere: a ball pressed, then dragged until it begins to slip.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.rigs.twin_rig import SCENES, turns_ms
from gelslim_twin.contact.gel_state import ContactError
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.planning.question import plan_scene
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.reader import LoadedScene, read_scene
from gelslim_twin.simulation.sensor import BUNDLE, TwinSensor
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.mesh.pad_mesh import PadMesh

Array = NDArray[np.float64]
Rows = list[dict[str, Any]]
SCENE = SCENES / "shear_sphere.yaml"
FRICTIONS = (0.0, 0.6)
TOLERANCES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 1e-4, 1e-5, 1e-6)
TIGHTEST, TIGHT = 1e-9, 1e-7
STEPS, MOST_STEPS = (1, 2, 3, 5, 10, 20, 40), 160
LAYERS, MOST_LAYERS = (1, 2, 3, 4, 5, 6, 7, 8), 12
FREE = 1e9
"""No limit to how far a touched node is dragged in a step: the steps are those given."""


@dataclass(frozen=True)
class Rungs:
    """What is tried, and against what."""

    tolerances: tuple[float, ...] = TOLERANCES
    steps: tuple[int, ...] = STEPS
    most_steps: int = MOST_STEPS
    layers: tuple[int, ...] = LAYERS
    most_layers: int = MOST_LAYERS
    rounds: int = 5


FULL, QUICK = Rungs(), Rungs((1e-1, 1e-3, 1e-5), (1, 3, 10), 20, (1, 2, 4), 6, 2)


def solver_ladders(sensor: TwinSensor, folder: Path, quick: bool) -> dict[str, Rows]:
    """Tolerance and load steps, without and with friction."""
    loaded, rungs = read_scene(SCENE), QUICK if quick else FULL
    compliance = SurfaceCompliance(sensor.bundle, folder)
    found: dict[str, Rows] = {"contact": [], "steps": []}
    for friction in FRICTIONS:
        auto = chosen_tolerance(loaded, folder, friction)
        found["contact"] += tolerances(loaded, compliance, friction, auto, rungs)
        found["steps"] += steps(loaded, compliance, friction, rungs)
    return found


def layer_ladder(sensor: TwinSensor, folder: Path, quick: bool) -> dict[str, Rows]:
    """Layers, without and with friction; their pads are not kept."""
    loaded, rungs = read_scene(SCENE), QUICK if quick else FULL
    pads = {
        n: SurfaceCompliance(with_layers(sensor.bundle, n))
        for n in (*rungs.layers, rungs.most_layers)
    }
    setup_s = {n: set_up(loaded, pad) for n, pad in pads.items()}
    rows = [row for friction in FRICTIONS for row in layers(loaded, pads, friction, rungs)]
    design = sensor.bundle.mesh.layers
    for row in rows:
        row |= {"setup_s": setup_s[row["layers"]], "design": row["layers"] == design}
    return {"layers": rows}


def chosen_tolerance(loaded: LoadedScene, folder: Path, friction: float) -> float:
    """The solver's tolerance that the planner takes for the scene with this friction."""
    contact = loaded.scene.contact.model_copy(update={"friction": friction})
    scene = loaded.scene.model_copy(update={"contact": contact})
    plan = plan_scene(replace(loaded, model=scene), bundle_figures(folder / BUNDLE))
    names = ("normal_contact", "friction")
    knobs = [dict(c.rung_parameters) for c in plan.included if c.effect in names]
    return float(min(k["tolerance"] for k in knobs))


def solved(
    loaded: LoadedScene,
    compliance: SurfaceCompliance,
    settings: ContactSettings,
    poses: Sequence[Pose] | None = None,
) -> list[Array]:
    """Forces (c, 3) at every pose. Raises ContactError."""
    tool = Tool.of(loaded.scene.indenters, loaded.folder, loaded.scene.seed)
    solver = ContactSolver(compliance, tool, settings)
    return [s.force_n for s in solver.states(tuple(poses or loaded.poses))]


def off(forces: Sequence[Array], true: Sequence[Array]) -> dict[str, float]:
    """Fields (c, 3) over all poses and of the worst pose, relative L2; worst resultant in N."""
    pairs = [(f, t) for f, t in zip(forces, true, strict=True) if t.any()]
    missed = np.array([np.linalg.norm(f - t) for f, t in pairs])
    size = np.array([np.linalg.norm(t) for _, t in pairs])
    return {
        "field_error": float(np.linalg.norm(missed) / np.linalg.norm(size)),
        "worst_pose": float((missed / size).max()),
        "resultant_error_n": max(float(np.linalg.norm((f - t).sum(axis=0))) for f, t in pairs),
    }


def tolerances(
    loaded: LoadedScene, compliance: SurfaceCompliance, friction: float, auto: float, rungs: Rungs
) -> Rows:
    """Rungs of the solver's tolerance against a far tighter one."""
    true = solved(loaded, compliance, ContactSettings(TIGHTEST, friction))
    every = sorted({*rungs.tolerances, auto}, reverse=True)
    calls = [
        partial(solved, loaded, compliance, ContactSettings(tolerance, friction))
        for tolerance in every
    ]
    times = turns_ms(calls, rungs.rounds)
    return [
        {"friction": friction, "tolerance": tolerance, **off(call(), true),
         "ms": ms / len(loaded.poses), "auto": tolerance == auto}
        for tolerance, call, ms in zip(every, calls, times, strict=True)
    ]  # fmt: skip


def path_in(loaded: LoadedScene, count: int) -> tuple[Pose, ...]:
    """The scene's first pose, then each of its movements in `count` steps."""
    corners, found = [loaded.poses[0]], [loaded.poses[0]]
    for waypoint in loaded.scene.motion.waypoints or ():
        corners.append(loaded.poses[waypoint.steps + loaded.poses.index(corners[-1])])
        start, end = corners[-2:]
        for part in np.arange(1, count) / count:
            names = ("time_s", "x_mm", "y_mm", "depth_mm")
            blend = {n: (1 - part) * getattr(start, n) + part * getattr(end, n) for n in names}
            found.append(Pose(**blend))
        found.append(end)
    return tuple(found)


def steps(
    loaded: LoadedScene, compliance: SurfaceCompliance, friction: float, rungs: Rungs
) -> Rows:
    """Load steps per movement against many; the last pose is judged, the time is the path's."""

    def last(count: int) -> list[Array]:
        settings = ContactSettings(TIGHT, friction, longest_step=FREE)
        return solved(loaded, compliance, settings, path_in(loaded, count))[-1:]

    true, rows = last(rungs.most_steps), []
    for count in rungs.steps:
        try:
            error = off(last(count), true)
        except ContactError as reason:
            rows.append({"friction": friction, "steps": count, "failed": str(reason)})
            continue
        rows.append({"friction": friction, "steps": count, **error})
    able = [row for row in rows if "failed" not in row]
    calls: list[Callable[[], Any]] = [partial(last, row["steps"]) for row in able]
    for row, ms in zip(able, turns_ms(calls, max(2, rungs.rounds // 2)), strict=True):
        row["ms"] = ms
    return rows


def with_layers(bundle: Bundle, count: int) -> Bundle:
    """The bundle's pad in `count` layers on the same surface nodes."""
    mesh = bundle.mesh
    hx, hy, hz = mesh.cell_size_mm
    plan = np.asarray(mesh.occupancy)[:, :, :1]
    cells = np.ascontiguousarray(np.repeat(plan, count, axis=2))
    made = PadMesh.from_occupancy(cells, (hx, hy, hz * mesh.layers / count), mesh.origin_mm)
    return build_bundle(made, bundle.material, "bbar", with_stiffness=False)


def set_up(loaded: LoadedScene, compliance: SurfaceCompliance) -> float:
    """CPU seconds of making the compliance of the nodes that the scene touches."""
    settings = ContactSettings()
    started = time.process_time()
    solved(loaded, compliance, settings)
    middle = time.process_time()
    solved(loaded, compliance, settings)
    return max(0.0, middle - started - (time.process_time() - middle))


def layers(
    loaded: LoadedScene, pads: dict[int, SurfaceCompliance], friction: float, rungs: Rungs
) -> Rows:
    """Cells through the thickness against many."""
    settings = ContactSettings(1e-5, friction)
    calls = {n: partial(solved, loaded, pad, settings) for n, pad in pads.items()}
    forces = {n: call() for n, call in calls.items()}
    times = dict(zip(calls, turns_ms(list(calls.values()), rungs.rounds), strict=True))
    most = rungs.most_layers
    return [
        {"friction": friction, "layers": n, "against": most, **off(forces[n], forces[most]),
         "ms": times[n] / len(loaded.poses)}
        for n in rungs.layers
    ]  # fmt: skip
