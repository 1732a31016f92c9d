"""Latency of the force pipeline per stage, beside the paper's own choices and other trackers.

    python -m bench.force.force_latency                    # writes docs/data/force_latency.json
    python -m bench.force.force_latency --quick            # fewer frames, prints only
    python -m bench.force.force_latency --frames 100000    # memory and time over that many too
    python -m bench.force.force_latency --processor        # processor time, on a busy machine

640 x 480 frames of a push with shear and its release, on one core; set OMP_NUM_THREADS=1. The
paper's chain searches every frame whole, takes the nearest dot, corrects by the printed formula,
interpolates by Delaunay triangles (scipy's griddata) and multiplies by the stiffness of one layer.
The trackers (`force_trackers.py`) see the same frames and take turns with the chains.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import cycle, islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.bench_data import DOCS, ROOT, write_data
from bench.rigs.force_ladder_markers import nearest_dots
from bench.rigs.force_rig import SEED, Rig, large_rig, shares, small_rig
from bench.rigs.force_trackers import tracker_chain, trackers
from bench.rigs.machine import machine
from gelslim_core.budget.budget import Budget
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.contact.normal_source import NormalSource
from gelslim_force.joint.sensor_source import unknown_shape
from gelslim_force.joint.settings import ON_NODES, JointSettings
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.sensor import indenter_source
from gelslim_force.settings import PipelineSettings

Array = NDArray[np.float64]
CYCLE = 48
LOOSE = 0.25
"""Error budget, in the worst contact, of the second half of the chains; the first take their
bundle's own operator."""
MEANS = ("error_px", "misplaced")
"""What a tracker tells beside its time."""
WARM_UP = 2 * CYCLE
LEAST_CYCLES = 3
SOAK_REPORTS = 10
Clock = Callable[[], float]
Chain = Callable[[int], dict[str, float]]
"""Runs frame k of the cycle and returns the time per stage in ms."""


def main() -> None:
    """Measure, print, and write JSON."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="fewer frames, printed only")
    parser.add_argument("--docs", type=Path, help="folder to write data/ in")
    parser.add_argument("--frames", type=int, default=0, help="frames of the soak")
    parser.add_argument("--timed", type=int, default=2016, help="frames timed per chain")
    parser.add_argument("--processor", action="store_true", help="time of the processor")
    options = parser.parse_args()
    timed = 240 if options.quick else options.timed
    keep_to_one_core()
    clock = time.thread_time if options.processor else time.perf_counter
    data: dict[str, Any] = {**machine(SEED), "frames": timed, "chains": [], "trackers": []}
    data["clock"] = "processor" if options.processor else "wall"
    data["load"] = round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None
    for rig in (small_rig(), large_rig()):
        size = {"markers": len(rig.grid), "nodes": len(rig.bundle.mesh.surface_mm)}
        for row in measured(rig, timed, clock):
            data["trackers" if "error_px" in row else "chains"].append({**size, **row})
    for row in data["chains"] + data["trackers"]:
        print(line(row))
    data["first_frame"] = first_frame(large_rig())
    print("first frame in a fresh process: {ready_s:.2f} s, of which imports {imports_s:.2f} s, "
          "bundle {bundle_s:.2f} s, pipeline {pipeline_s:.2f} s, frame {frame_s:.2f} s"
          .format(**data["first_frame"]))  # fmt: skip
    if options.frames:
        data["soak"] = soak(large_rig(), options.frames)
    if options.docs or not options.quick:
        write_data("force_latency", data, options.docs or DOCS)


def keep_to_one_core() -> None:
    """Pin this process where the system can."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def measured(rig: Rig, timed: int, clock: Clock) -> list[dict[str, Any]]:
    """Stage times of every chain and tracker on one sensor; they take turns, so that all see the
    same load of the machine."""
    drawn = rig.stream(CYCLE)
    frames = [f.image for f in drawn]
    calibration = calibrate(rig.bundle, frames[0])
    chains = dict(all_chains(rig, frames, calibration, clock))
    markers = calibration.reference.markers
    for name, follow in trackers(calibration, frames[0]):
        chains[name] = tracker_chain(follow, drawn, markers, clock)
    found: dict[str, list[dict[str, float]]] = {name: [] for name in chains}
    for chain in chains.values():
        for k in range(WARM_UP):
            chain(k % CYCLE)
    for start in range(0, timed, CYCLE):
        for name, chain in chains.items():
            found[name] += [chain(k) for k in range(min(CYCLE, timed - start))]
    return [{"chain": name, **summary(times)} for name, times in found.items()]


def all_chains(
    rig: Rig, frames: list[NDArray[np.uint8]], calibration: Calibration, clock: Clock
) -> Iterator[tuple[str, Chain]]:
    """The chains compared, by name."""
    known = [share * rig.press.nodes_mm[:, 2] for share in shares(CYCLE)]
    linear = PipelineSettings(gel="linear")
    loose = replace(linear, budget=Budget(error=LOOSE))
    for suffix, chosen, gel in (
        ("", JointSettings(), "linear"),
        (", on nodes", ON_NODES, "linear"),
        (", gel auto", JointSettings(), "auto"),
    ):
        # The rig draws grey values in proportion to the light.
        drawn = replace(chosen, gamma=1.0)
        anything = unknown_shape(rig.bundle, calibration, frames[0], gel=gel, settings=drawn)
        chain = ForcePipeline(rig.bundle, calibration, PipelineSettings(gel=gel), anything)
        yield f"any object{suffix}", pipeline_chain(chain, frames, clock)
    for suffix, settings in (
        ("", linear),
        (f", {LOOSE:.0%}", loose),
        (", gel auto", PipelineSettings()),
    ):

        def opened(
            settings: PipelineSettings = settings, normal: NormalSource | None = None
        ) -> ForcePipeline:
            return ForcePipeline(rig.bundle, calibration, settings, normal)

        yield f"tangential{suffix}", pipeline_chain(opened(), frames, clock)
        yield f"depth given{suffix}", pipeline_chain(opened(), frames, clock, known)
        sphere = indenter_source(
            rig.bundle, calibration, frames[0], rig.press.sphere, settings=settings
        )
        yield f"sphere seen{suffix}", pipeline_chain(opened(normal=sphere), frames, clock)
    yield "paper's choices", paper_chain(rig, calibration, frames, known, clock)


def pipeline_chain(
    pipeline: ForcePipeline,
    frames: list[NDArray[np.uint8]],
    clock: Clock,
    normal_mm: list[Array] | None = None,
) -> Chain:
    """Our chain; with the depth given, or from the pipeline's own source, or none."""

    def run(k: int) -> dict[str, float]:
        started = clock()
        result = pipeline.process(frames[k], normal_mm=None if normal_mm is None else normal_mm[k])
        total = (clock() - started) * 1000
        if result.field is None:
            raise SystemExit(f"frame {k} gave no forces: {'; '.join(result.problems)}")
        # The pipeline's own stages are times of the wall.
        stages = result.stage_ms if clock is time.perf_counter else {}
        return {**stages, "total": total}

    return run


def paper_chain(
    rig: Rig,
    calibration: Calibration,
    frames: list[NDArray[np.uint8]],
    normal_mm: list[Array],
    clock: Clock,
) -> Chain:
    """The paper's choices with our detector: no verification, no low-pass, no covariance."""
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

    from gelslim_force.detection.detection import Detector
    from gelslim_force.forces.wrench import resultant
    from gelslim_force.motion.marker_motion import MarkerView
    from ifem_export.markers.interpolation import marker_to_node

    reference = calibration.reference
    view = MarkerView(calibration.camera, reference.positions_px)
    detector = Detector(calibration.detector)
    operator = rig.bundle.surface_operator("paper")
    nodes = np.asarray(rig.bundle.mesh.surface_mm)
    to_markers = marker_to_node(nodes, view.rest_mm)
    last = [reference.positions_px]

    def run(k: int) -> dict[str, float]:
        marks = [clock()]
        dots = detector.detect(frames[k])
        last[0] = dots.centres_px[nearest_dots(last[0], dots.centres_px)]
        marks.append(clock())
        lateral = view.lateral_motion(last[0], to_markers @ normal_mm[k], "printed")
        marks.append(clock())
        u = np.empty_like(nodes)
        rest = view.rest_mm[:, :2]
        inside = LinearNDInterpolator(rest, lateral)(nodes[:, :2])
        beyond = NearestNDInterpolator(rest, lateral)(nodes[:, :2])
        u[:, :2] = np.where(np.isnan(inside), beyond, inside)
        u[:, 2] = normal_mm[k]
        marks.append(clock())
        force = operator.force(u)
        marks.append(clock())
        resultant(nodes, force)
        marks.append(clock())
        steps = np.diff(marks) * 1000
        names = ("track", "displace", "interpolate", "force", "wrench")
        return {**dict(zip(names, map(float, steps), strict=True)), "total": float(steps.sum())}

    return run


def summary(times: list[dict[str, float]]) -> dict[str, Any]:
    """Median, 95th and 99th percentile per stage in ms, and means; stages that a frame skips count
    0.

    `own` is of the frames of the cycle, of which each has its median over the cycles: what the work
    of a frame itself differs, without what else the machine does. It needs three cycles.
    """
    names = list(dict.fromkeys(name for t in times for name in t))
    table = {name: np.array([t.get(name, 0.0) for t in times]) for name in names}
    means = {name: float(np.mean(table.pop(name))) for name in MEANS if name in table}
    cycles = len(times) // CYCLE
    if cycles >= LEAST_CYCLES:
        table["own"] = np.median(table["total"][: cycles * CYCLE].reshape(cycles, CYCLE), axis=0)
    return means | {
        name: dict(zip(("median", "p95", "p99"), map(float, np.percentile(v, (50, 95, 99))),
                       strict=True))
        for name, v in table.items()
    }  # fmt: skip


def line(row: dict[str, Any]) -> str:
    """One chain or tracker as text."""
    total = row["total"]
    notes = [
        f"{name} {v['median']:.2f}"
        for name, v in row.items()
        if isinstance(v, dict) and name not in ("total", "own")
    ]
    if "error_px" in row:
        notes = [f"error {row['error_px']:.3f} px, misplaced {row['misplaced']:.2%}"]
    return (
        f"{row['markers']:4d} markers  {row['chain']:32s} "
        f"{total['median']:6.2f} ms, p95 {total['p95']:6.2f}, p99 {total['p99']:6.2f}  "
        f"({', '.join(notes)})"
    )


CHILD = """
import time; begun = time.perf_counter()
import sys
import numpy as np
from gelslim_force.calibration.file import read_calibration
from gelslim_force.pipeline import ForcePipeline
from ifem_export.bundle.files import load_bundle
marks = [time.perf_counter()]
bundle = load_bundle(sys.argv[1] + "/bundle"); marks.append(time.perf_counter())
built = read_calibration(sys.argv[1] + "/calibration.npz")
pipeline = ForcePipeline(bundle, built); marks.append(time.perf_counter())
result = pipeline.process(np.load(sys.argv[1] + "/frame.npy")); marks.append(time.perf_counter())
assert result.wrench is not None, result.problems
print(*np.diff([begun, *marks]))
"""


def first_frame(rig: Rig) -> dict[str, float]:
    """Seconds from the start of a process to the wrench of its first frame, compiled before."""
    from gelslim_force.calibration.file import write_calibration
    from ifem_export.bundle.files import write_bundle

    frame = rig.stream(2)[1].image
    with tempfile.TemporaryDirectory() as folder:
        write_bundle(Path(folder) / "bundle", rig.bundle)
        write_calibration(calibrate(rig.bundle, rig.stream(1)[0].image),
                          Path(folder) / "calibration.npz")  # fmt: skip
        np.save(Path(folder) / "frame.npy", frame)
        for _ in range(2):
            started = time.perf_counter()
            told = subprocess.run(
                [sys.executable, "-c", CHILD, folder],
                check=True, capture_output=True, text=True, cwd=ROOT,
            ).stdout  # fmt: skip
            ready = time.perf_counter() - started
    names = ("imports_s", "bundle_s", "pipeline_s", "frame_s")
    return {"ready_s": ready, **dict(zip(names, map(float, told.split()), strict=True))}


def soak(rig: Rig, count: int) -> dict[str, Any]:
    """Memory and time over many frames with the depth given; the first tenth is warm-up."""
    images = [f.image for f in rig.stream(CYCLE)]
    pipeline = ForcePipeline(rig.bundle, calibrate(rig.bundle, images[0]))
    known = [share * rig.press.nodes_mm[:, 2] for share in shares(CYCLE)]
    pairs: Iterable[tuple[NDArray[np.uint8], Array]] = islice(
        cycle(zip(images, known, strict=True)), count
    )
    step = max(count // SOAK_REPORTS, 1)
    memory, medians, times = [], [], []
    for k, (image, normal) in enumerate(pairs, 1):
        started = time.perf_counter()
        result = pipeline.process(image, normal_mm=normal)
        times.append((time.perf_counter() - started) * 1000)
        if result.wrench is None:
            raise SystemExit(f"frame {k} of the soak gave no forces: {'; '.join(result.problems)}")
        if k % step == 0:
            memory.append(resident_mb())
            medians.append(float(np.median(times)))
            times.clear()
            print(f"soak {k:7d} frames: {memory[-1]:.1f} MB, median {medians[-1]:.2f} ms")
    growth = memory[-1] - memory[0]
    print(f"soak: memory grew by {growth:+.2f} MB after the first {step} of {count} frames")
    return {"frames": count, "growth_mb": growth, "resident_mb": memory, "median_ms": medians}


def resident_mb() -> float:
    """Resident memory of this process; NaN where the system does not tell."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1])
    except OSError:
        return float("nan")
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


if __name__ == "__main__":
    main()
