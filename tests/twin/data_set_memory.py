"""Peak memory of this process while data sets of growing size are made; run by a test.

    python tests/twin/data_set_memory.py FOLDER

Everything but the samples themselves is that of `gelslim dataset`. Prints the peak in bytes after
each stage as JSON.
"""

from __future__ import annotations

import json
import os
import resource
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from data_set_rig import job_in, written

from gelslim_twin.datasets.data_set import all_shards, make_data_set
from gelslim_twin.datasets.formats import format_named
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


def peak_bytes() -> int:
    """Largest memory of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def main() -> None:
    folder, found = Path(sys.argv[1]), {}
    SampleMaker.sample = sample  # type: ignore[method-assign]
    given = {"frames_per_shard": 1024}
    scene = written(folder)
    one = job_in(scene, "one", **given)
    other = job_in(written(folder, ("seed: 8", "seed: 9"), "other.yaml"), "other", **given)
    make_data_set(other, FEW)
    for count in (FEW, MANY):
        make_data_set(one, count)
        found[f"made {count}"] = peak_bytes()
    assert verify(one.out_folder)["faults"] == []
    found["verified"] = peak_bytes()
    assert merge([one.out_folder, other.out_folder], folder / "merged")["samples"] == FEW + MANY
    found["merged"] = peak_bytes()
    robot = job_in(scene, "robot", format_name="lerobot", **given)
    for count in (FEW, MANY):
        described(robot, count)
        found[f"described {count}"] = peak_bytes()
    print(json.dumps(found))


def described(job, count: int) -> None:  # type: ignore[no-untyped-def]
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
    described_in = job.out_folder / f"described_{count}"
    described_in.mkdir()
    format_named("lerobot").complete(described_in, job.out_folder, wanted, {"name": "touches"})
    told = json.loads((described_in / places.INFO_PATH).read_bytes())
    assert told["total_episodes"] == count


if __name__ == "__main__":
    main()
