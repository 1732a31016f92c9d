"""A thousand frames through the pipeline and the writers of `gelslim force`; memory told.

Run as a program of its own, so that what is resident is the pipeline's: `soaked_pipeline.py OUT`
prints JSON with the resident memory in kB every `EVERY` frames and what the run came to.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "force"))
from sensor_samples import sensor_bundle
from shaded_frames import pressed_heights, shaded

from gelslim.cli.force_run import RunOutputs, result_sinks
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.frames.frame import Frame
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.run import run_frames
from gelslim_force.sensor import indenter_source

FRAMES, EVERY = 1000, 10
TOUCHED_MM = (None, 1.8, 2.4, 1.8)
"""Radius that a ball of 10 mm radius touches, frame after frame and again."""
UNREADABLE, BLACK = 97, 101
"""Every so many frames one that could not be read, and one without light."""


def resident_kb() -> int:
    """Pages of this process in memory now."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") // 1024


def pressed_again_and_again() -> Iterator[Frame]:
    """Presses and releases, each picture a new array as a camera's are."""
    drawn = []
    for k, radius in enumerate(TOUCHED_MM):
        slopes = None if radius is None else pressed_heights((1.0, -1.0), radius, 10.0)[:2]
        drawn.append(shaded(slopes, seed=k).image)
    for k in range(FRAMES):
        if k % UNREADABLE == UNREADABLE - 1:
            yield Frame(k, k / 30, None, "torn picture")
        elif k % BLACK == BLACK - 1:
            yield Frame(k, k / 30, np.zeros_like(drawn[0]))
        else:
            yield Frame(k, k / 30, drawn[k % len(drawn)].copy())


def soak(out: Path) -> dict[str, object]:
    """The run; memory is looked at after the writers had the frame."""
    sensor = sensor_bundle()
    still = shaded(seed=99).image
    built = calibrate(sensor, still)
    normal = indenter_source(sensor, built, still, "sphere:10")
    pipeline = ForcePipeline(sensor, built, normal=normal)
    memory: list[int] = []

    def watch(text: str, done: int, total: int) -> None:
        if done % EVERY == 0:
            memory.append(resident_kb())

    outputs = RunOutputs(
        out, "npz", 1, video=None, mcap=None, rerun=None, view=False, overwrite=False, quiet=True
    )
    with ExitStack() as stack:
        sinks, pictures = result_sinks(stack, pipeline, outputs, {}, 30.0)
        summary = run_frames(pipeline, pressed_again_and_again(), sinks, FRAMES, watch)
    return {
        "memory_kb": memory, "every": EVERY, "frames": summary.frames,
        "with_forces": summary.with_forces, "problems": summary.problems,
        "pictures": 0 if pictures is None else len(pictures.write()),
    }  # fmt: skip


if __name__ == "__main__":
    print(json.dumps(soak(Path(sys.argv[1]))))
