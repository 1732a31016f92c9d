"""Pace of this machine: measured time of a simulated pose over the time that effects declare.

A sphere is pressed into the sensor and sheared, once on a linear gel and once at large strain.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from threadpoolctl import threadpool_limits

from gelslim_core.files.replaced_folder import scratch_folder
from gelslim_twin.effects.circumstances import SensorFigures
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.planning.tolerance_ladder import GEL, LARGE_STRAIN, PICTURE, pace_group
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.simulation.scene_task import job_of
from gelslim_twin.simulation.sensor import BUNDLE, TwinSensor, store_sensor, stored_sensor
from gelslim_twin.simulation.simulate import Ledger, simulate

Progress = Callable[[str, int, int], None]
DEPTH, RADIUS = 0.1, 2.0
"""Depth and radius of the sphere over the thickness of the gel."""
RUNS = (("first", "off"), ("linear", "off"), ("large", "on"))
"""Name of each run and its use of `nonlinearity`."""
SCENE = """\
format: gelslim-scene/1
name: pace
sensor: {{bundle: {bundle}}}
indenters:
  - {{shape: sphere, radius_mm: {radius:.6g}}}
motion:
  waypoints:
    - {{move: press, depth_mm: {depth:.6g}, steps: 8, duration_s: 0.8}}
    - {{move: shear, x_mm: {depth:.6g}, steps: 4, duration_s: 0.4}}
contact: {{friction: 0.6}}
observe: [displacement, force, markers, image]
effects:
  nonlinearity: {{use: {large_strain}}}
"""


def measure_paces(
    sensor: TwinSensor, progress: Progress | None = None
) -> tuple[dict[str, float], SensorFigures]:
    """Ratios of measured to declared times by group of effects, and the figures of the sensor.

    For the groups see `tolerance_ladder.pace_group`. Raises what `simulate` raises.
    """
    tell = progress or (lambda text, done, total: None)
    with scratch_folder() as folder:
        store_sensor(sensor, folder / "sensor")
        runs = {}
        # The first run computes the compliance of the pad and compiles what is not compiled yet.
        for step, (name, strain) in enumerate(RUNS):
            tell(f"simulation, {name} run", step, len(RUNS))
            runs[name] = _run(folder, name, strain)
        figures = bundle_figures(folder / "sensor" / BUNDLE)
    (linear, plan), (large, strained) = runs["linear"], runs["large"]
    poses = plan.poses
    gel_ms = 1000 * linear.seconds.get("gel", 0.0) / poses
    more_ms = 1000 * large.seconds.get("gel", 0.0) / poses - gel_ms
    seen = sum(linear.seconds.get(part, 0.0) for part in ("markers", "image"))
    found = {
        GEL: gel_ms / _declared(plan, GEL),
        LARGE_STRAIN: more_ms / _declared(strained, LARGE_STRAIN),
        PICTURE: 1000 * seen / max(1, linear.frames_drawn) / _declared(plan, PICTURE),
    }
    return {group: pace for group, pace in found.items() if pace > 0}, figures


def _run(folder: Path, name: str, large_strain: str) -> tuple[Ledger, Plan]:
    kept = folder / "sensor"
    sensor = stored_sensor(kept)
    mesh = sensor.bundle.mesh
    thickness = mesh.layers * mesh.cell_size_mm[2]
    text = SCENE.format(
        bundle=f"sensor/{BUNDLE}",
        radius=RADIUS * thickness,
        depth=DEPTH * thickness,
        large_strain=large_strain,
    )
    path = folder / f"{name}.yaml"
    path.write_text(text, encoding="utf-8", newline="\n")
    job = job_of(read_scene(path), sensor, kept)
    with threadpool_limits(limits=1, user_api="blas"):
        return simulate(job, folder / name), job.plan


def _declared(plan: Plan, group: str) -> float:
    return sum(c.predicted_ms for c in plan.included if pace_group(c.effect) == group)
