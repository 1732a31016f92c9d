"""Peak memory of this process in each stage of data sets of two sizes; run by a test on Linux.

    python tests/twin/data_set_memory.py FOLDER

Everything but the samples themselves is that of `gelslim dataset`. Prints the peaks in bytes as
JSON.
"""

from __future__ import annotations

import ctypes
import gc
import json
import os
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from data_set_rig import job_in, written

from gelslim_twin.datasets.data_set import all_shards, make_data_set
from gelslim_twin.datasets.formats import format_named
from gelslim_twin.datasets.job import DataSetJob
from gelslim_twin.datasets.lerobot import places
from gelslim_twin.datasets.making import SampleMaker
from gelslim_twin.datasets.merge import merge
from gelslim_twin.datasets.sample import Sample, SampleFrame
from gelslim_twin.datasets.shard_task import ShardTask, perform
from gelslim_twin.datasets.verify import verify

FEW, MANY = 10_240, 102_400
WRENCH = ("fx_n", "fy_n", "fz_n", "tx_nmm", "ty_nmm", "tz_nmm")


def sample(maker: SampleMaker, number: int) -> Sample:
    """A sample of one frame, with numbers that cost nothing."""
    job = maker.job
    tool = job.drawn_tool(number)
    values = np.random.default_rng(number).normal(size=12)
    labels = {f"label_{k}": float(value) for k, value in enumerate(values[6:])}
    labels |= dict(zip(WRENCH, values[:6].tolist(), strict=True))
    draws = {"tool": job.loaded.tools[tool].name, "sensor": number % 2, "x_mm": float(values[0])}
    frame = SampleFrame(0, 0.0, labels, None, {"force_n": values[:6].reshape(2, 3)})
    return Sample(
        number, job.sample_id(number), number, job.division.of(number, tool), draws, (frame,)
    )


def peak_bytes(stage: Callable[[], object]) -> int:
    """Largest memory of this process in a stage, by the kernel's count."""
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)  # else what was freed before hides what grows now
    Path("/proc/self/clear_refs").write_text("5")  # forgets the peak of before
    stage()
    found = re.search(r"VmHWM:\s+([0-9]+) kB", Path("/proc/self/status").read_text())
    assert found is not None
    return 1024 * int(found.group(1))


def main() -> None:
    folder, found = Path(sys.argv[1]), {}
    SampleMaker.sample = sample  # type: ignore[method-assign]
    scene, given = written(folder), {"frames_per_shard": 1024}
    one, two, three = (
        job_in(written(folder, ("seed: 8", f"seed: {k}"), f"{k}.yaml"), f"set_{k}", **given)
        for k in (1, 2, 3)
    )
    robot = job_in(scene, "robot", format_name="lerobot", **given)
    for job in (two, three):
        make_data_set(job, FEW)
        verify(job.out_folder)
    # Libraries and allocators take their shares once.
    merge([two.out_folder, three.out_folder], folder / "merged")
    described(robot, FEW, folder / "described")
    for count, mine, other in ((FEW, two, three), (MANY, one, two)):
        stages: dict[str, Callable[[], object]] = {
            "made": lambda job=one, count=count: make_data_set(job, count),
            "verified": lambda job=mine: verify(job.out_folder),
            "merged": lambda a=mine, b=other, count=count: merge(
                [a.out_folder, b.out_folder], folder / f"merged_{count}"
            ),
            "described": lambda count=count: described(robot, count, folder / f"described_{count}"),
        }
        found |= {f"{name} {count}": peak_bytes(stage) for name, stage in stages.items()}
    for place, count in ((one.out_folder, MANY), (folder / f"merged_{MANY}", MANY + FEW)):
        answer = verify(place)
        assert (answer["samples"], answer["faults"]) == (count, [])
    print(json.dumps(found))


def described(job: DataSetJob, count: int, target_folder: Path) -> None:
    """Describe a data set of LeRobot whose shards have the content of the first."""
    wanted = all_shards(replace(job, division=replace(job.division, tools=("train",) * 3)), count)
    first = job.out_folder / places.episode_file(wanted[0])
    if not first.is_file():
        perform(ShardTask(job, wanted[0], {}))
    for shard in wanted:
        for place in (places.episode_file, places.data_file):
            target = job.out_folder / place(shard)
            target.parent.mkdir(parents=True, exist_ok=True)
            if not target.exists():
                os.link(job.out_folder / place(wanted[0]), target)
    target_folder.mkdir()
    format_named("lerobot").complete(target_folder, job.out_folder, wanted, {"name": "touches"})
    told = json.loads((target_folder / places.INFO_PATH).read_bytes())
    assert told["total_episodes"] == count


if __name__ == "__main__":
    main()
