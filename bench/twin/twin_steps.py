"""Time and error of single steps of the twin, as a physics engine asks for them.

    python -m bench.twin.twin_steps            # writes docs/data/twin_steps.json
    python -m bench.twin.twin_steps --quick    # fewer steps, printed only

A body presses, slides and turns on the sensor of designs/gelslim2.yaml, 2 ms a step. Times are of
the processor (user and system), on one thread. The error is that of the resultant force against
the same steps at the finest tolerance of the solver, relative to the force of the step.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

import gelslim
from bench.bench_data import DOCS, write_data
from bench.rigs.machine import machine
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.twin import Twin

Array = NDArray[np.float64]
DT_S, FINEST, FRICTION = 0.002, "0.01%", 0.6
TOLERANCES = ("5%", "2%", "1%", "0.3%")
BODIES = (
    ("ball, radius 4 mm", Body.sphere(4.0), 4.0),
    ("ball, radius 10 mm", Body.sphere(10.0), 10.0),
    ("box, 6 x 6 mm", Body.box(6.0, 6.0, 6.0), 3.0),
)
DEPTH_MM, SLIDE_MM, TURN_DEG = 0.3, 0.8, 6.0


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="fewer steps, printed only")
    parser.add_argument("--docs", type=Path, help="folder like docs to write in")
    asked = parser.parse_args()
    steps = 60 if asked.quick else 300
    with tempfile.TemporaryDirectory() as place, threadpool_limits(limits=1):
        spec = DOCS.parent / "designs" / "gelslim2.yaml"
        gelslim.write_bundle(place, gelslim.make_bundle(spec, measure=False).bundle)
        data = {**machine(), "steps": steps, "bodies": [], "picture": picture(place, steps)}
        for name, body, height in BODIES:
            data["bodies"].append({"name": name, "rungs": rungs(place, body, height, steps)})
    print(table(data))
    if not asked.quick or asked.docs:
        write_data("twin_steps", data, asked.docs or DOCS)


def path(height_mm: float, steps: int) -> Array:
    """Rigid motions (steps, 4, 4): down, then a loop over the gel with a turn."""
    share = np.arange(1, steps + 1) / steps
    down = np.minimum(1.0, 4 * share)
    phase = 2 * np.pi * np.maximum(0.0, share - 0.25)
    found = np.tile(np.eye(4), (steps, 1, 1))
    found[:, 0, 3] = SLIDE_MM * np.sin(phase)
    found[:, 1, 3] = SLIDE_MM * (1 - np.cos(phase))
    found[:, 2, 3] = height_mm - DEPTH_MM * down
    found[:, :3, :3] = Rotation.from_euler("z", TURN_DEG * phase[:, None], degrees=True).as_matrix()
    return found


def stepped(place: str, body: Body, tolerance: str, poses: Array) -> tuple[Array, Any, list[float]]:
    """Forces (n, 3), the last step, and seconds of each step, once everything is compiled."""
    twin = Twin(
        place,
        tolerance={"force": tolerance},
        friction=FRICTION,
        effects={"nonlinearity": "off"},
        keep=place,
    )
    twin.prepare()
    twin.add(body)
    for pose in poses[: len(poses) // 3]:
        twin.step(pose, DT_S)
    twin.reset()
    forces, seconds = [], []
    for pose in poses:
        begun = time.process_time()
        step = twin.step(pose, DT_S)
        seconds.append(time.process_time() - begun)
        forces.append(step.wrench[:3])
    return np.array(forces), step, seconds


def rungs(place: str, body: Body, height_mm: float, steps: int) -> list[dict[str, Any]]:
    """Time and error at each tolerance."""
    poses = path(height_mm, steps)
    known, _, _ = stepped(place, body, FINEST, poses)
    found = []
    for tolerance in TOLERANCES:
        forces, last, seconds = stepped(place, body, tolerance, poses)
        # Once the contact has some size.
        late = slice(len(poses) // 4, None)
        off = np.linalg.norm((forces - known)[late], axis=1)
        begun = time.process_time()
        assert last.stiffness.shape == (6, 6)
        found.append(
            {
                "tolerance": tolerance,
                "median_ms": 1e3 * float(np.median(seconds[late])),
                "p95_ms": 1e3 * float(np.percentile(seconds[late], 95)),
                "worst_error": float((off / np.linalg.norm(known[late], axis=1)).max()),
                "nodes": int((last.gel.touch > 0).sum()),
                "stiffness_ms": 1e3 * (time.process_time() - begun),
            }
        )
    return found


def picture(place: str, steps: int) -> dict[str, float]:
    """Milliseconds of a picture and of the markers alone."""
    twin = Twin(
        place,
        ("force", "markers", "image"),
        friction=FRICTION,
        effects={"nonlinearity": "off"},
        keep=place,
    )
    twin.prepare()
    twin.add(BODIES[0][1])
    drawn, marked = [], []
    for number, pose in enumerate(path(BODIES[0][2], steps)):
        step = twin.step(pose, DT_S)
        if number % 10:
            continue
        begun = time.process_time()
        assert step.markers_px.shape[1] == 2
        middle = time.process_time()
        assert step.image().dtype == np.uint8
        drawn.append(time.process_time() - middle)
        marked.append(middle - begun)
    # The first ones prepare camera and renderer.
    return {
        "image_ms": 1e3 * float(np.median(drawn[2:])),
        "markers_ms": 1e3 * float(np.median(marked[2:])),
    }


def table(data: Mapping[str, Any]) -> str:
    """The table of docs/twin_steps.md."""
    lines = [
        "| body | nodes | asked | largest error | median, ms | 95 %, ms | stiffness, ms |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for body in data["bodies"]:
        lines += [
            f"| {body['name']} | {r['nodes']} | {r['tolerance']} | {100 * r['worst_error']:.2g} % "
            f"| {r['median_ms']:.1f} | {r['p95_ms']:.1f} | {r['stiffness_ms']:.1f} |"
            for r in body["rungs"]
        ]
    seen = data["picture"]
    lines += [
        "",
        f"A picture takes {seen['image_ms']:.1f} ms, the images of the dots alone "
        f"{seen['markers_ms']:.2f} ms. {data['steps']} steps each, one thread of "
        f"{data['processor']}.",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
